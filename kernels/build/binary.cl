// The binary BVH from clustering, before it is collapsed to the wide BVH: a BinaryNode has the box around its two
// children.
#include "build/primitives.cl"
#include "core/mask.cl"

// A child is a node index, or ~p for primitive p.
static inline Box node_box(const Primitives *primitives, global const BinaryNode *nodes, int node) {
    if (node < 0) return primitive_box(primitives, ~node);
    return (Box){vload3(0, nodes[node].lo), vload3(0, nodes[node].hi)};
}

// Prefetch a node; primitives and EMPTY are ignored.
static inline void prefetch_node(global const BinaryNode *nodes, int node) {
    if ((uint)node < EMPTY) { PREFETCH(nodes + node, 32) }
}

static inline void prefetch_children(global const BinaryNode *nodes, int node) {
    if ((uint)node >= EMPTY) return;
    prefetch_node(nodes, nodes[node].left);
    prefetch_node(nodes, nodes[node].right);
}
