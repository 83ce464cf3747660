// Refit one level of the layout bvh2 (clrt/accel/layouts.py), whose leaves are consecutive triangles.
#include "build/refit.cl"

static inline Box refit_triangle(global const float *vertices, global const int *faces, global Triangles *leaf) {
    Corners corners = face_corners(vertices, faces, leaf->primitive);
    vstore3(corners.p0, 0, leaf->p0);
    vstore3(corners.p1, 0, leaf->p1);
    vstore3(corners.p2, 0, leaf->p2);
    return corners_box(corners);
}

static inline Box node_bounds(global const Node *node) {
    return (Box){vload3(0, node->aabb_min), vload3(0, node->aabb_max)};
}

kernel void refit_level(uint count, uint block, REFIT_PARAMETERS) {
    uint first = (uint)get_global_id(0) * block, end = first + block < count ? first + block : count;
    for (uint i = first; i < end; ++i) {
        global Node *node = nodes + first_node + i;
        int below = node->left_first;
        Box box = NO_BOX;
        for (int leaf = below; leaf < below + node->count; ++leaf)
            box = box_union(box, refit_triangle(vertices, faces, leaves + leaf));
        if (node->count == 0) box = box_union(node_bounds(nodes + below), node_bounds(nodes + below + 1));
        vstore3(box.lo, 0, node->aabb_min);
        vstore3(box.hi, 0, node->aabb_max);
    }
}
