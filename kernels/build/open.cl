// The wide tree's nodes, level by level from the root, as the plans say; each level is one range of consecutive nodes.
#include "build/collapse.cl"

// What stands in a slot: a wide node, a leaf of triangles or one of spheres. `units`: leaf records that it takes.
typedef struct { bool leaf, sphere; uint count, units; } Content;

static inline Content content_of(const Primitives *primitives, global const uint *plans, int node) {
    Content c = {true, false, 1, 1};
    if (node < 0) {
        c.sphere = is_sphere(primitives, ~node);
        return c;
    }
    c.leaf = (plans[node] & IS_LEAF) != 0;
    c.sphere = (plans[node] & HAS_SPHERES) != 0;
    c.count = COUNT(plans[node]);
    c.units = c.sphere || PACK == 1 ? c.count : 1;
    return c;
}

// The binary nodes that become the children of those in `tops`: slots[CHILDREN][i], EMPTY at the end. Then how many
// wide nodes, triangle and sphere records they need: places[0], [1], [2], each with `count` entries.
// waiting: entries on a traversal's stack when it comes to a node; most[0]: the most of all with its children's.
kernel void open_nodes(uint count, uint block, PRIMITIVE_PARAMETERS, global const int *tops, global const int *waiting,
                       global const BinaryNode *nodes, global const uint *plans, global int *slots, global uint *places,
                       global int *most) {
    Primitives primitives = PRIMITIVE_ARGUMENTS;
    uint first = (uint)get_global_id(0) * block, end = first + block < count ? first + block : count;
    for (uint i = first; i < end; ++i) {
        int slot[CHILDREN], roots[CHILDREN], used = 2;
        slot[0] = nodes[tops[i]].left;
        slot[1] = nodes[tops[i]].right;
        roots[0] = SHARE(plans[tops[i]], CHILDREN);
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
        uint need[3] = {0, 0, 0};
        for (int s = 0; s < used; ++s) {
            Content c = content_of(&primitives, plans, slot[s]);
            need[c.leaf ? 1 + c.sphere : 0] += c.leaf ? c.units : 1;
        }
        for (int s = 0; s < CHILDREN; ++s) slots[CHILDREN * i + s] = s < used ? slot[s] : EMPTY;
        for (int k = 0; k < 3; ++k) places[k * count + i] = need[k];
        atomic_max(most, waiting[i] + used);
    }
}

// The next level's tops. places: scanned.
kernel void next_tops(uint count, uint block, PRIMITIVE_PARAMETERS, global const int *waiting, global const uint *plans,
                      global const int *slots, global const uint *places, global int *tops, global int *next_waiting) {
    Primitives primitives = PRIMITIVE_ARGUMENTS;
    uint first = (uint)get_global_id(0) * block, end = first + block < count ? first + block : count;
    for (uint i = first; i < end; ++i) {
        uint place = places[i];
        int used = 0;
        while (used < CHILDREN && slots[CHILDREN * i + used] != EMPTY) ++used;
        for (int s = 0; s < used; ++s) {
            int node = slots[CHILDREN * i + s];
            if (content_of(&primitives, plans, node).leaf) continue;
            tops[place] = node;
            next_waiting[place++] = waiting[i] + used - 1;
        }
    }
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
