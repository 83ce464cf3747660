// The wide tree's nodes, level by level from the root, as the plans say; each level is one range of consecutive nodes.
#include "build/collapse.cl"

// What stands in a slot: a wide node, a leaf of triangles or one of spheres. `units`: leaf records that it takes.
typedef struct { bool leaf, sphere; uint count, units; } Content;

static inline Content content_of(const Primitives *primitives, global const uint *plans, int node) {
    uint plan = plan_of(primitives, plans, node), count = COUNT(plan);
    bool sphere = (plan & HAS_SPHERES) != 0;
    return (Content){(plan & IS_LEAF) != 0, sphere, count, sphere || PACK == 1 ? count : 1};
}

// The binary nodes that become the children of a wide one in place of `top`, and how many they are.
static inline int open_node(global const BinaryNode *nodes, global const uint *plans, int top, int *slot) {
    int roots[CHILDREN], used = 2;
    slot[0] = nodes[top].left;
    slot[1] = nodes[top].right;
    roots[0] = SHARE(plans[top], CHILDREN);
    roots[1] = CHILDREN - roots[0];
    for (int s = 0; s < used;) {
        int node = slot[s], b = roots[s], share = node < 0 || b < 2 ? 0 : SHARE(plans[node], b);
        if (share == 0) {
            ++s;
            continue;
        }
        slot[s] = nodes[node].left;
        roots[s] = share;
        slot[used] = nodes[node].right;
        roots[used++] = b - share;
    }
    return used;
}

// The level below `count` wide nodes. slots: [CHILDREN] a node, binary nodes, EMPTY at the end. places[0]: the first
// wide child of each. waiting: entries on a traversal's stack when it comes to a node. All three are filled in for the
// `below` children; places[0], [1], [2], each with `below` entries, with how many wide nodes and records of triangles
// and spheres each of them needs. most[0]: the most entries on the stack after a node has pushed its children.
kernel void open_level(uint count, uint block, PRIMITIVE_PARAMETERS, global const BinaryNode *nodes,
                       global const uint *plans, global const int *slots, global const uint *places,
                       global const int *waiting, uint below, global int *next_slots, global uint *next_places,
                       global int *next_waiting, global int *most) {
    Primitives primitives = PRIMITIVE_ARGUMENTS;
    uint first = (uint)get_global_id(0) * block, end = first + block < count ? first + block : count;
    int fullest = 0;
    for (uint i = first; i < end; ++i) {
        uint child = places[i];
        int used = 0;
        while (used < CHILDREN && slots[CHILDREN * i + used] != EMPTY) ++used;
        for (int s = 0; s < used; ++s) {
            int top = slots[CHILDREN * i + s];
            if (content_of(&primitives, plans, top).leaf) continue;
            int slot[CHILDREN], children = open_node(nodes, plans, top, slot);
            uint need[3] = {0, 0, 0};
            for (int k = 0; k < CHILDREN; ++k) {
                next_slots[CHILDREN * child + k] = k < children ? slot[k] : EMPTY;
                if (k >= children) continue;
                Content c = content_of(&primitives, plans, slot[k]);
                need[c.leaf ? 1 + c.sphere : 0] += c.leaf ? c.units : 1;
            }
            for (int k = 0; k < 3; ++k) next_places[k * below + child] = need[k];
            int left = waiting[i] + used - 1;
            next_waiting[child++] = left;
            fullest = left + children > fullest ? left + children : fullest;
        }
    }
    if (fullest > 0) atomic_max(most, fullest);
}

// The primitives of a leaf's subtree, from left to right.
static inline int leaf_primitives(global const BinaryNode *nodes, int node, int *primitives) {
    int waiting[LEAF_SIZE], top = 0, count = 0;
    for (;;) {
        while (node >= 0) {
            waiting[top++] = nodes[node].right;
            node = nodes[node].left;
        }
        primitives[count++] = ~node;
        if (top == 0) return count;
        node = waiting[--top];
    }
}
