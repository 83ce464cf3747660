// Sort primitives along a space-filling curve by the Morton codes of their boxes' centres, 21 bits per axis.
#include "build/primitives.cl"
#include "build/sort.cl"
#include "build/tiles.cl"
#include "core/mask.cl"

#define SHAPES_AHEAD 16   // prefetch distance, in primitives

#define SCENE_PARAMETERS global const float *triangles, global const float *spheres, uint triangle_count

// The nine or four floats of primitive i of the scene.
static inline global const float *scene_shape(global const float *triangles, global const float *spheres,
                                              uint triangle_count, uint i) {
    return i < triangle_count ? triangles + SHAPE * i : spheres + 4 * (i - triangle_count);
}

static inline float3 twice_centre(Box box) { return box.lo + box.hi; }

// Bounds of twice the centres in each tile: low in partial[0 … 2], high in partial[3 … 5].
kernel void centre_bounds(uint count, uint block, SCENE_PARAMETERS, global float *partial) {
    local float lows[3 * TILE_ITEMS];
    local float highs[3 * TILE_ITEMS];
    TILE_RANGE
    Box bounds = NO_BOX;
    for (uint i = first + me; i < end; i += items) {
        float3 centre = twice_centre(shape_box(scene_shape(triangles, spheres, triangle_count, i), i >= triangle_count));
        bounds = box_union(bounds, (Box){centre, centre});
    }
    vstore3(bounds.lo, me, lows);
    vstore3(bounds.hi, me, highs);
    barrier(CLK_LOCAL_MEM_FENCE);
    if (me > 0) return;
    for (uint k = 1; k < items; ++k) bounds = box_union(bounds, (Box){vload3(k, lows), vload3(k, highs)});
    vstore3(bounds.lo, 2 * tile, partial);
    vstore3(bounds.hi, 2 * tile + 1, partial);
}

// Spread the 21 bits of x, three places apart.
static inline ulong spread(uint x) {
    ulong s = x;
    s = (s | s << 32) & 0x001f00000000ffffUL;
    s = (s | s << 16) & 0x001f0000ff0000ffUL;
    s = (s | s << 8) & 0x100f00f00f00f00fUL;
    s = (s | s << 4) & 0x10c30c30c30c30c3UL;
    return (s | s << 2) & 0x1249249249249249UL;
}

kernel void morton_codes(uint count, uint block, SCENE_PARAMETERS, float low_x, float low_y, float low_z, float scale,
                         global ulong *codes, global uint *order) {
    uint first = (uint)get_global_id(0) * block, end = first + block < count ? first + block : count;
    float3 low = (float3)(low_x, low_y, low_z);
    for (uint i = first; i < end; ++i) {
        Box box = shape_box(scene_shape(triangles, spheres, triangle_count, i), i >= triangle_count);
        float3 cell = (twice_centre(box) - low) * scale;
        uint3 c = convert_uint3(cell < 2097151.0f ? cell : (float3)(2097151.0f));
        codes[i] = spread(c.x) << 2 | spread(c.y) << 1 | spread(c.z);
        order[i] = i;
    }
}

// Gather the scene's primitives `ids` contiguously.
kernel void gather_shapes(uint count, uint block, SCENE_PARAMETERS, global const uint *ids, global float *shapes) {
    uint first = (uint)get_global_id(0) * block, end = first + block < count ? first + block : count;
    for (uint i = first; i < end; ++i) {
        if (i + SHAPES_AHEAD < end) { PREFETCH(scene_shape(triangles, spheres, triangle_count, ids[i + SHAPES_AHEAD]), 64) }
        uint floats = SPHERES && ids[i] >= triangle_count ? 4 : SHAPE;
        global const float *shape = scene_shape(triangles, spheres, triangle_count, ids[i]);
        for (uint k = 0; k < floats; ++k) shapes[SHAPE * i + k] = shape[k];
    }
}
