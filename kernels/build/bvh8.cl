// Write the nodes and leaves of one level in the layout bvh8 (clrt/accel/layouts.py, kernels/traverse/bvh8.cl).
#include "build/leaves.cl"

kernel void write_level(uint count, uint block, LEVEL_PARAMETERS) {
    FOR_NODES {
        global Node *node = nodes + first_node + i;
        OPEN_NODE
        float areas = 0.0f;
        for (int s = 0; s < CHILDREN; ++s) {
            Content content = contents[s];
            Box box = NO_BOX;
            int child = EMPTY;
            if (content.count > 0) {
                box = node_box(&primitives, binary, content.node);
                areas += visited_area(box, content);
                child = (int)fill_slot(&primitives, binary, content, &next, triangles, leaf_spheres);
                if (content.leaf) child = ~(child << 4 | content.sphere << 3 | (int)(content.count - 1));
            }
            WRITE_COLUMN(node->lo, s, box.lo)
            WRITE_COLUMN(node->hi, s, box.hi)
            node->child[s] = child;
            node->pad[s] = 0;
        }
        visited[first_node + i] = areas;
    }
}
