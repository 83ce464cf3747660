// The binary tree between clustering and the wide tree: BinaryNode with the box around its two children.
#include "build/primitives.cl"

// A child is a node, or ~p for primitive p.
static inline Box node_box(const Primitives *primitives, global const BinaryNode *nodes, int node) {
    if (node < 0) return primitive_box(primitives, ~node);
    return (Box){vload3(0, nodes[node].lo), vload3(0, nodes[node].hi)};
}
