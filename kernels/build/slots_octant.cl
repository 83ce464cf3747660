// Put the children of a wide node into slots so that near ones come first for all rays (Ylitie, Karras and Laine 2017,
// 3.2): slot i should hold the child farthest towards the corner of the node that is on the high side of axis a if bit
// a of i is set.
#include "build/binary.cl"

static inline float towards(float3 offset, int slot) {
    return (slot & 1 ? offset.x : -offset.x) + (slot & 2 ? offset.y : -offset.y) + (slot & 4 ? offset.z : -offset.z);
}

// Greedy assignment: of the remaining children and slots, the best pair is chosen repeatedly.
static inline void put_in_slots(const Primitives *primitives, global const BinaryNode *nodes, int top,
                                const int *children, int used, global int *slots) {
    Box around = node_box(primitives, nodes, top);
    float3 offset[CHILDREN];
    for (int c = 0; c < used; ++c) {
        Box box = node_box(primitives, nodes, children[c]);
        offset[c] = (box.lo + box.hi) - (around.lo + around.hi);
    }
    for (int s = 0; s < CHILDREN; ++s) slots[s] = EMPTY;
    uint placed = 0;
    for (int turn = 0; turn < used; ++turn) {
        int child = 0, slot = 0;
        float best = -INFINITY;
        for (int c = 0; c < used; ++c) {
            for (int s = 0; s < CHILDREN; ++s) {
                float fit = towards(offset[c], s);
                if ((placed >> c & 1) || slots[s] != EMPTY || !(fit > best)) continue;
                best = fit;
                child = c;
                slot = s;
            }
        }
        slots[slot] = children[child];
        placed |= 1u << child;
    }
}
