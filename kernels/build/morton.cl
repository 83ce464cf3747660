// Primitives in the order of a space-filling curve: Morton codes of their boxes' centres, 21 bits an axis.
#include "build/primitives.cl"

// Twice the centres' bounds over each block: low in partial[0 … 2], high in partial[3 … 5].
kernel void centre_bounds(uint count, uint block, PRIMITIVE_PARAMETERS, global float *partial) {
    Primitives primitives = PRIMITIVE_ARGUMENTS;
    uint first = (uint)get_global_id(0) * block, end = first + block < count ? first + block : count;
    if (first >= count) return;
    Box bounds = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    for (uint i = first; i < end; ++i) {
        Box box = primitive_box(&primitives, i), centre;
        for (int k = 0; k < 3; ++k) centre.lo[k] = centre.hi[k] = box.lo[k] + box.hi[k];
        bounds = box_union(bounds, centre);
    }
    for (int k = 0; k < 3; ++k) {
        partial[6 * get_global_id(0) + k] = bounds.lo[k];
        partial[6 * get_global_id(0) + 3 + k] = bounds.hi[k];
    }
}

// The 21 bits of x, three places apart.
static inline ulong spread(uint x) {
    ulong s = x;
    s = (s | s << 32) & 0x001f00000000ffffUL;
    s = (s | s << 16) & 0x001f0000ff0000ffUL;
    s = (s | s << 8) & 0x100f00f00f00f00fUL;
    s = (s | s << 4) & 0x10c30c30c30c30c3UL;
    return (s | s << 2) & 0x1249249249249249UL;
}

kernel void morton_codes(uint count, uint block, PRIMITIVE_PARAMETERS, float low_x, float low_y, float low_z, float scale,
                         global ulong *codes, global uint *order) {
    Primitives primitives = PRIMITIVE_ARGUMENTS;
    uint first = (uint)get_global_id(0) * block, end = first + block < count ? first + block : count;
    float low[3] = {low_x, low_y, low_z};
    for (uint i = first; i < end; ++i) {
        Box box = primitive_box(&primitives, i);
        ulong code = 0;
        for (int k = 0; k < 3; ++k) {
            float cell = (box.lo[k] + box.hi[k] - low[k]) * scale;
            code |= spread(cell < 2097151.0f ? (uint)cell : 2097151u) << (2 - k);
        }
        codes[i] = code;
        order[i] = i;
    }
}
