// From the binary tree to one of CHILDREN children a node at least expected work, by dynamic programming (Ylitie, Karras
// and Laine 2017, 3.1): 1 a node, 1 an intersection of PACK triangles or a sphere, times the chance that a ray comes there.
//
// The chance to meet a box is that of rays that start inside the scene, as a renderer's do: the share of its volume, for
// those that start in it, and of the others half the share of its area, since they run one way along their line. The surface
// area heuristic is for rays from without; it thinks the walls of a room, which have no volume, twice as likely to be met,
// and packs several into one leaf that every ray meets. Trees of scans come out the same.
//
// A subtree can be a leaf if it holds up to LEAF_SIZE primitives of one kind. With PACK > 1 one that can is, unless it
// saves the share WORTHWHILE when opened: to save less would leave packs half empty.
#include "build/binary.cl"

#define WORTHWHILE 0.2f

// A node's plan: for b = 2 … CHILDREN three bits say how many of b roots that stand for its subtree are the left
// child's, 0 where it stays whole; then whether it is a leaf, which kinds it holds, whether it stays whole for any b, and
// how many primitives it holds (at most 127).
#define SHARE(plan, b) ((plan) >> (3 * ((b) - 2)) & 7)
#define IS_LEAF 0x200000u
#define HAS_TRIANGLES 0x400000u
#define HAS_SPHERES 0x800000u
#define WHOLE 0x1000000u
#define COUNT(plan) ((plan) >> 25)

static inline bool fits_leaf(uint plan) {
    return COUNT(plan) <= LEAF_SIZE && (plan & (HAS_TRIANGLES | HAS_SPHERES)) != (HAS_TRIANGLES | HAS_SPHERES);
}

// Here and below products stand in an fma, alone if need be, so that none can be contracted with a sum, or not.
static inline float chance(Box box, Box scene) {
    float volume = 1.0f;
    for (int k = 0; k < 3; ++k) {
        float size = scene.hi[k] - scene.lo[k];
        volume = size > 0.0f ? fma(volume, (box.hi[k] - box.lo[k]) / size, 0.0f) : volume;
    }
    float all = half_area(scene), area = all > 0.0f ? half_area(box) / all : 1.0f;
    return fma(1.0f - volume, fma(0.5f, area, 0.0f), volume);
}

static inline float leaf_cost(uint plan, Box box, Box scene) {
    uint count = COUNT(plan);
    return fma(chance(box, scene), (float)(plan & HAS_SPHERES ? count : (count + PACK - 1) / PACK), 0.0f);
}

static inline uint plan_of(const Primitives *primitives, global const uint *plans, int node) {
    if (node >= 0) return plans[node];
    return IS_LEAF | (is_sphere(primitives, ~node) ? HAS_SPHERES : HAS_TRIANGLES) | WHOLE | 1u << 25;
}

// cost[b] with at most b = 1 … CHILDREN − 1 roots. Nodes below which everything stays whole have only one, cost[1]; the row
// of such a node holds what it would cost with any number of roots.
static inline void costs_of(const Primitives *primitives, global const BinaryNode *nodes, global const float *costs,
                            int node, uint plan, Box scene, float *cost) {
    bool whole = node < 0 || (plan & WHOLE);
    float leaf = whole ? leaf_cost(plan, node_box(primitives, nodes, node), scene) : 0.0f;
    for (int b = 1; b < CHILDREN; ++b) cost[b] = whole ? leaf : costs[(CHILDREN - 1) * node + b - 1];
}

// What a subtree that can be a leaf costs at least, whatever stands for it.
static inline float least_cost(const Primitives *primitives, global const BinaryNode *nodes, global const float *costs,
                               int node, uint plan, Box scene) {
    return node < 0 ? leaf_cost(plan, primitive_box(primitives, ~node), scene) : costs[(CHILDREN - 1) * node + CHILDREN - 2];
}

// The plan of a node from its children's, and its costs. The root is never a leaf.
static inline uint plan_node(const Primitives *primitives, global const BinaryNode *nodes, global const uint *plans,
                             global float *costs, int node, int root) {
    int left = nodes[node].left, right = nodes[node].right;
    uint left_plan = plan_of(primitives, plans, left), right_plan = plan_of(primitives, plans, right);
    uint count = COUNT(left_plan) + COUNT(right_plan);
    uint plan = ((left_plan | right_plan) & (HAS_TRIANGLES | HAS_SPHERES)) | (count < 127 ? count : 127) << 25;
    bool may_be_leaf = node != root && fits_leaf(plan);
    Box scene = node_box(primitives, nodes, root), box = node_box(primitives, nodes, node);
    float leaf = may_be_leaf ? leaf_cost(plan, box, scene) : INFINITY;
    if (PACK > 1 && may_be_leaf) {
        float opened = least_cost(primitives, nodes, costs, left, left_plan, scene)
                     + least_cost(primitives, nodes, costs, right, right_plan, scene);
        costs[(CHILDREN - 1) * node + CHILDREN - 2] = opened < leaf ? opened : leaf;
        if (opened >= (1.0f - WORTHWHILE) * leaf) return plan | IS_LEAF | WHOLE | 1u << 3 * (CHILDREN - 2);
    }
    float from_left[CHILDREN], from_right[CHILDREN], best[CHILDREN + 1];
    costs_of(primitives, nodes, costs, left, left_plan, scene, from_left);
    costs_of(primitives, nodes, costs, right, right_plan, scene, from_right);
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
    float whole = chance(box, scene) + best[CHILDREN];
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
