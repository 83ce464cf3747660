// Refit one level of the layout bvh8 (clrt/accel/layouts.py), whose leaves are packs of eight triangles.
#include "build/refit.cl"

// Unused lanes, which come last, keep their NaN corners.
static inline Box refit_pack(global const float *vertices, global const int *faces, global Triangles *pack) {
    Box box = NO_BOX;
    for (int lane = 0; lane < 8 && pack->primitive[lane] >= 0; ++lane) {
        Corners corners = face_corners(vertices, faces, pack->primitive[lane]);
        WRITE_COLUMN(pack->p0, lane, corners.p0)
        WRITE_COLUMN(pack->p1, lane, corners.p1)
        WRITE_COLUMN(pack->p2, lane, corners.p2)
        box = box_union(box, corners_box(corners));
    }
    return box;
}

static inline float least(float8 a) {
    float4 four = a.lo < a.hi ? a.lo : a.hi;
    float2 two = four.lo < four.hi ? four.lo : four.hi;
    return two.x < two.y ? two.x : two.y;
}

// The bounds of all children; boxes of unused slots are inverted.
static inline Box node_bounds(global const Node *node) {
    return (Box){(float3)(least(vload8(0, node->lo[0])), least(vload8(0, node->lo[1])), least(vload8(0, node->lo[2]))),
                 -(float3)(least(-vload8(0, node->hi[0])), least(-vload8(0, node->hi[1])), least(-vload8(0, node->hi[2])))};
}

kernel void refit_level(uint count, uint block, REFIT_PARAMETERS) {
    uint first = (uint)get_global_id(0) * block, end = first + block < count ? first + block : count;
    for (uint i = first; i < end; ++i) {
        global Node *node = nodes + first_node + i;
        for (int slot = 0; slot < 8; ++slot) {
            int child = node->child[slot];
            if (child == EMPTY) continue;
            Box box = child < 0 ? refit_pack(vertices, faces, leaves + (~child >> 4)) : node_bounds(nodes + child);
            WRITE_COLUMN(node->lo, slot, box.lo)
            WRITE_COLUMN(node->hi, slot, box.hi)
        }
    }
}
