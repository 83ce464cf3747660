// Build the nodes of the wide BVH level by level from the root, following the plans; each level is a range of
// consecutive nodes.
#include "build/collapse.cl"
#include SLOTS

// The content of a slot: a wide node, a leaf of triangles or of spheres, or nothing if count is 0. `units`: the leaf
// records that it takes.
typedef struct { int node; bool leaf, sphere; uint count, units; } Content;

static inline void contents_of(const Primitives *primitives, global const uint *plans, global const int *slots,
                               Content *contents) {
    bool triangles = false;
    for (int s = 0; s < CHILDREN; ++s) {
        int node = slots[s];
        uint plan = node == EMPTY ? 0 : plan_of(primitives, plans, node), count = COUNT(plan);
        bool leaf = (plan & IS_LEAF) != 0, sphere = (plan & HAS_SPHERES) != 0;
        contents[s] = (Content){node, leaf, sphere, count, sphere ? count : (count + LANES - 1) / LANES};
        triangles |= leaf && !sphere;
    }
#if ONE_KIND
    // A node with leaves of both kinds: those of spheres get nodes of their own.
    for (int s = 0; s < CHILDREN; ++s) contents[s].leaf = contents[s].leaf && !(triangles && contents[s].sphere);
#endif
}

// The binary nodes that become the children of a wide node in place of `top`; EMPTY in unused slots.
static inline void open_node(const Primitives *primitives, global const BinaryNode *nodes, global const uint *plans,
                             int top, global int *slots) {
    int slot[CHILDREN], roots[CHILDREN], used = 1;
    slot[0] = top;
    roots[0] = CHILDREN;
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
    put_in_slots(primitives, nodes, top, slot, used, slots);
}

// Prefetch the children of the nodes that the next wide node holds, and the nodes that the one after it holds.
static inline void prefetch_slots(global const BinaryNode *nodes, global const uint *plans, global const int *slots,
                                  uint i, uint end) {
    if (i + 2 >= end) return;
    for (int s = 0; s < CHILDREN; ++s) {
        int node = slots[CHILDREN * (i + 2) + s];
        prefetch_children(nodes, slots[CHILDREN * (i + 1) + s]);
        prefetch_node(nodes, node);
        if ((uint)node < EMPTY) { PREFETCH(plans + node, 4) }
    }
}

typedef struct { int children; uint nodes, triangles, spheres; } Needs;

// The number of a node's children, and of the wide nodes and leaf records they take.
static inline Needs needs_of(const Content *contents) {
    Needs needs = {0, 0, 0, 0};
    for (int s = 0; s < CHILDREN; ++s) {
        Content c = contents[s];
        needs.children += c.count > 0;
        needs.nodes += c.count > 0 && !c.leaf;
        needs.triangles += c.leaf && !c.sphere ? c.units : 0;
        needs.spheres += c.leaf && c.sphere ? c.units : 0;
    }
    return needs;
}

// Open the nodes below `count` wide ones. slots: [CHILDREN] per node, of binary nodes and EMPTY. places: starts with
// the index of the first wide child of each node. waiting: entries on the traversal stack when it reaches a node; with
// GROUPS, the child nodes of one node are one entry. All three are written for the `below` children, with three times
// as many places: how many wide nodes, records of triangles and of spheres each needs. most[0]: the maximum number of
// entries on the stack.
kernel void open_level(uint count, uint block, PRIMITIVE_PARAMETERS, global const BinaryNode *nodes,
                       global const uint *plans, global const int *slots, global const uint *places,
                       global const int *waiting, uint below, global int *next_slots, global uint *next_places,
                       global int *next_waiting, global int *most) {
    Primitives primitives = PRIMITIVE_ARGUMENTS;
    uint first = (uint)get_global_id(0) * block, end = first + block < count ? first + block : count;
    int fullest = 0;
    for (uint i = first; i < end; ++i) {
        prefetch_slots(nodes, plans, slots, i, end);
        Content above[CHILDREN], contents[CHILDREN];
        contents_of(&primitives, plans, slots + CHILDREN * i, above);
        Needs needs = needs_of(above);
        int left = waiting[i] + (GROUPS ? needs.nodes > 1 : needs.children - 1);
        uint child = places[i];
        for (int s = 0; s < CHILDREN; ++s) {
            if (above[s].count == 0 || above[s].leaf) continue;
            open_node(&primitives, nodes, plans, above[s].node, next_slots + CHILDREN * child);
            contents_of(&primitives, plans, next_slots + CHILDREN * child, contents);
            needs = needs_of(contents);
            next_places[child] = needs.nodes;
            next_places[below + child] = needs.triangles;
            next_places[2 * below + child] = needs.spheres;
            next_waiting[child++] = left;
            int entries = left + (GROUPS ? 0 : needs.children);
            fullest = entries > fullest ? entries : fullest;
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
