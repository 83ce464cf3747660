// Writes nodes and leaves of the layout bvh8 (clrt/accel/layouts.py, kernels/traverse/bvh8.cl) for one level.
#include "build/leaves.cl"

// first_node, next_node: the first node of this level and of the next. first_pack, first_sphere: of this level.
kernel void write_level(uint count, uint block, PRIMITIVE_PARAMETERS, global const BinaryNode *binary,
                        global const uint *plans, global const int *slots, global const uint *places, uint first_node,
                        uint next_node, uint first_pack, uint first_sphere, global Node *nodes, global Triangles *packs,
                        global LeafSphere *leaf_spheres) {
    Primitives primitives = PRIMITIVE_ARGUMENTS;
    uint first = (uint)get_global_id(0) * block, end = first + block < count ? first + block : count;
    for (uint i = first; i < end; ++i) {
        global Node *node = nodes + first_node + i;
        uint child = next_node + places[i];
        uint place[2] = {first_pack + places[count + i], first_sphere + places[2 * count + i]};
        for (int s = 0; s < CHILDREN; ++s) {
            int below = slots[CHILDREN * i + s];
            Box box = NO_BOX;
            int reference = EMPTY;
            if (below != EMPTY) {
                box = node_box(&primitives, binary, below);
                Content content = content_of(&primitives, plans, below);
                reference = (int)child;
                if (content.leaf) {
                    uint leaf = place[content.sphere];
                    write_leaf(&primitives, binary, below, content, leaf, packs, leaf_spheres);
                    reference = ~(int)(leaf << 4 | (uint)content.sphere << 3 | (content.count - 1));
                    place[content.sphere] += content.units;
                } else {
                    ++child;
                }
            }
            node->lo[0][s] = box.lo.x;
            node->lo[1][s] = box.lo.y;
            node->lo[2][s] = box.lo.z;
            node->hi[0][s] = box.hi.x;
            node->hi[1][s] = box.hi.y;
            node->hi[2][s] = box.hi.z;
            node->child[s] = reference;
            node->pad[s] = 0;
        }
    }
}
