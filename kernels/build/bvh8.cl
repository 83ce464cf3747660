// Write the nodes and leaves of one level in the layout bvh8 (clrt/accel/layouts.py, kernels/traverse/bvh8.cl).
#include "build/leaves.cl"

static inline void write_lane(global float (*rows)[CHILDREN], int lane, float3 v) {
    rows[0][lane] = v.x;
    rows[1][lane] = v.y;
    rows[2][lane] = v.z;
}

kernel void write_level(uint count, uint block, LEVEL_PARAMETERS) {
    Primitives primitives = PRIMITIVE_ARGUMENTS;
    uint first = (uint)get_global_id(0) * block, end = first + block < count ? first + block : count;
    float areas = 0.0f;
    for (uint i = first; i < end; ++i) {
        global Node *node = nodes + first_node + i;
        Places next = PLACES(i);
        prefetch_slots(binary, plans, slots, i, end);
        Content contents[CHILDREN];
        contents_of(&primitives, plans, slots + CHILDREN * i, contents);
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
            write_lane(node->lo, s, box.lo);
            write_lane(node->hi, s, box.hi);
            node->child[s] = child;
            node->pad[s] = 0;
        }
    }
    if (first < count) work[get_global_id(0)] += areas;
}
