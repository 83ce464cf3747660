// From the binary tree to one of CHILDREN children a node at least expected work, by dynamic programming over the
// surface area heuristic (Ylitie, Karras and Laine 2017, 3.1): 1 a node, 1 an intersection of PACK triangles or a sphere.
//
// A subtree can be a leaf if it holds up to LEAF_SIZE primitives of one kind. With PACK > 1 one that can is: opening it
// would pay off in work, by little, but would leave packs half empty.
#include "build/binary.cl"

// A node's plan: for b = 2 … CHILDREN three bits say how many of b roots that stand for its subtree are the left
// child's, 0 where it stays whole; then whether it is a leaf, which kinds it holds, and how many primitives (at most 255).
#define SHARE(plan, b) ((plan) >> (3 * ((b) - 2)) & 7)
#define IS_LEAF 0x200000u
#define HAS_TRIANGLES 0x400000u
#define HAS_SPHERES 0x800000u
#define COUNT(plan) ((plan) >> 24)

static inline bool fits_leaf(uint plan) {
    return COUNT(plan) <= LEAF_SIZE && (plan & (HAS_TRIANGLES | HAS_SPHERES)) != (HAS_TRIANGLES | HAS_SPHERES);
}

// An fma where a product would do, since a product could be contracted with the sum that it goes into, or not.
static inline float leaf_cost(uint plan, Box box) {
    uint count = COUNT(plan);
    return fma(half_area(box), (float)(plan & HAS_SPHERES ? count : (count + PACK - 1) / PACK), 0.0f);
}

static inline uint plan_of(const Primitives *primitives, global const uint *plans, int node) {
    if (node >= 0) return plans[node];
    return IS_LEAF | (is_sphere(primitives, ~node) ? HAS_SPHERES : HAS_TRIANGLES) | 1u << 24;
}

// cost[b] with at most b = 1 … CHILDREN − 1 roots. Nodes below which everything stays whole have no costs of their own.
static inline void costs_of(const Primitives *primitives, global const BinaryNode *nodes, global const float *costs,
                            int node, uint plan, float *cost) {
    bool whole = node < 0 || (PACK > 1 && (plan & IS_LEAF));
    float leaf = whole ? leaf_cost(plan, node_box(primitives, nodes, node)) : 0.0f;
    for (int b = 1; b < CHILDREN; ++b) cost[b] = whole ? leaf : costs[(CHILDREN - 1) * node + b - 1];
}

// The plan of a node from its children's, and its costs. The root is never a leaf.
static inline uint plan_node(const Primitives *primitives, global const BinaryNode *nodes, global const uint *plans,
                             global float *costs, int node, int root) {
    int left = nodes[node].left, right = nodes[node].right;
    uint left_plan = plan_of(primitives, plans, left), right_plan = plan_of(primitives, plans, right);
    uint count = COUNT(left_plan) + COUNT(right_plan);
    uint plan = ((left_plan | right_plan) & (HAS_TRIANGLES | HAS_SPHERES)) | (count < 255 ? count : 255) << 24;
    bool may_be_leaf = node != root && fits_leaf(plan);
    if (PACK > 1 && may_be_leaf) return plan | IS_LEAF | 1u << 3 * (CHILDREN - 2);
    float from_left[CHILDREN], from_right[CHILDREN], best[CHILDREN + 1];
    costs_of(primitives, nodes, costs, left, left_plan, from_left);
    costs_of(primitives, nodes, costs, right, right_plan, from_right);
    uint shares[CHILDREN + 1];
    for (int b = 2; b <= CHILDREN; ++b) {
        best[b] = INFINITY;
        shares[b] = 1;
        for (int k = 1; k < b; ++k) {
            float cost = from_left[k] + from_right[b - k];
            shares[b] = cost < best[b] ? k : shares[b];
            best[b] = cost < best[b] ? cost : best[b];
        }
    }
    Box box = node_box(primitives, nodes, node);
    float whole = half_area(box) + best[CHILDREN], leaf = may_be_leaf ? leaf_cost(plan, box) : INFINITY;
    if (leaf <= whole) plan |= IS_LEAF;
    whole = leaf <= whole ? leaf : whole;
    best[1] = whole;
    for (int b = 1; b < CHILDREN; ++b) {
        costs[(CHILDREN - 1) * node + b - 1] = best[b] < whole ? best[b] : whole;
        if (b > 1 && best[b] < whole) plan |= shares[b] << 3 * (b - 2);
    }
    return plan | shares[CHILDREN] << 3 * (CHILDREN - 2);
}

// Plans of `count` nodes from `node` on, whose children have theirs.
kernel void plan_nodes(uint count, uint block, PRIMITIVE_PARAMETERS, global const BinaryNode *nodes, uint node,
                       uint root, global uint *plans, global float *costs) {
    Primitives primitives = PRIMITIVE_ARGUMENTS;
    uint first = (uint)get_global_id(0) * block, end = first + block < count ? first + block : count;
    for (uint i = node + first; i < node + end; ++i) plans[i] = plan_node(&primitives, nodes, plans, costs, i, root);
}
