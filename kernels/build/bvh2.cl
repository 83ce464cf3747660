// Write the nodes and leaves of one level in the layout bvh2 (clrt/accel/layouts.py, kernels/traverse/bvh2.cl).
//
// A node's own record is in its parent's pair: the children of wide node w have the records 2 w + 2 and 2 w + 3. Record
// 0 is the root's, record 1 is unused.
#include "build/leaves.cl"

static inline void write_node(global Node *node, Box box, int left_first, int count) {
    vstore3(box.lo, 0, node->aabb_min);
    vstore3(box.hi, 0, node->aabb_max);
    node->left_first = left_first;
    node->count = count;
}

kernel void write_level(uint count, uint block, LEVEL_PARAMETERS) {
    FOR_NODES {
        uint children = 2 * (first_node + i + 1);
        OPEN_NODE
        float areas = 0.0f;
        Box around = NO_BOX;
        for (int s = 0; s < CHILDREN; ++s) {
            Content content = contents[s];
            Box box = node_box(&primitives, binary, content.node);
            int place = (int)fill_slot(&primitives, binary, content, &next, triangles, leaf_spheres);
            int many = content.sphere ? -(int)content.count : (int)content.count;
            write_node(nodes + children + s, box, content.leaf ? place : 2 * (place + 1), content.leaf ? many : 0);
            around = box_union(around, box);
            areas += visited_area(box, content);
        }
        if (children == 2) {
            write_node(nodes, around, 2, 0);
            write_node(nodes + 1, NO_BOX, 0, 0);
        }
        visited[first_node + i] = areas;
    }
}
