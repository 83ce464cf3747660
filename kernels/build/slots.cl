// Put the children of a wide node into its slots in order.
#include "build/binary.cl"

static inline void put_in_slots(const Primitives *primitives, global const BinaryNode *nodes, int top,
                                const int *children, int used, global int *slots) {
    for (int s = 0; s < CHILDREN; ++s) slots[s] = s < used ? children[s] : EMPTY;
}
