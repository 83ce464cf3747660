// Collapse the binary BVH to one with CHILDREN children per node of minimum expected cost, by dynamic programming
// (Ylitie, Karras and Laine 2017, 3.1): cost 1 per node and per intersection of PACK triangles or a sphere, times the
// probability that a ray reaches it.
//
// The probability of hitting a box is that of rays that start inside the scene, as a renderer's do: the fraction of its
// volume, for rays that start in the box, and half the fraction of its area for the others, since they run one way
// along their line. The surface area heuristic assumes rays from outside; it considers the walls of a room, which have
// no volume, twice as likely to be hit, and packs several into one leaf that every ray visits. BVHs of scans are the
// same with both.
//
// A subtree can be a leaf if it holds up to LEAF_SIZE primitives of one kind. With PACK > 1 it becomes one, unless
// opening it saves the fraction WORTHWHILE: smaller savings would leave packs half empty.
#include "build/binary.cl"

#define WORTHWHILE 0.2f
#define PLANS_AHEAD 8   // prefetch distance of children's plans, in nodes

// A node's plan: for b = 2 … CHILDREN three bits with the left child's share of b roots that replace its subtree, 0 if
// it stays whole; then whether it is a leaf, which kinds it holds, whether it stays whole for any b, and its number of
// primitives (at most 127).
#define SHARE(plan, b) ((plan) >> (3 * ((b) - 2)) & 7)
#define IS_LEAF 0x200000u
#define HAS_TRIANGLES 0x400000u
#define HAS_SPHERES 0x800000u
#define WHOLE 0x1000000u
#define COUNT(plan) ((plan) >> 25)
#define COUNTED(count) ((count) << 25)
#define MANY_COUNTED 127

static inline bool fits_leaf(uint plan) {
    return COUNT(plan) <= LEAF_SIZE && (plan & (HAS_TRIANGLES | HAS_SPHERES)) != (HAS_TRIANGLES | HAS_SPHERES);
}

static inline uint plan_of(const Primitives *primitives, global const uint *plans, int node) {
    if (node >= 0) return plans[node];
    return IS_LEAF | (is_sphere(primitives, ~node) ? HAS_SPHERES : HAS_TRIANGLES) | WHOLE | COUNTED(1);
}

// The number of intersection tests in a leaf.
static inline float tests_of(bool sphere, uint count) { return (float)(sphere ? count : (count + PACK - 1) / PACK); }

// Here and below products are in an fma, alone if necessary, so that contraction with a sum cannot differ between
// devices.
static inline float chance(Box box, const World *world) {
    float3 sides = fma(box.hi - box.lo, vload3(0, world->per_side), vload3(0, world->no_side));
    float volume = fma(sides.x * sides.y, sides.z, 0.0f), area = fma(half_area(box), world->per_area, world->no_area);
    return fma(1.0f - volume, 0.5f * area, volume);
}

// A binary BVH whose nodes are planned, children first. costs[b − 1] of a node: with at most b roots, b < CHILDREN,
// unless it stays whole. leaves, of a node that fits into a leaf: its cost as one, and its least cost with any
// replacement.
typedef struct {
    Primitives primitives;
    global const BinaryNode *nodes;
    global uint *plans;
    global float *costs;
    global float2 *leaves;
    World world;
} Planned;

static inline float2 leaf_costs(const Planned *tree, int node) {
    return node >= 0 ? tree->leaves[node] : (float2)(chance(primitive_box(&tree->primitives, ~node), &tree->world));
}

// cost[b] with at most b = 1 … CHILDREN − 1 roots.
static inline void costs_of(const Planned *tree, int node, float *cost) {
    bool whole = (plan_of(&tree->primitives, tree->plans, node) & WHOLE) != 0;
    float leaf = whole ? leaf_costs(tree, node).x : 0.0f;
    for (int b = 1; b < CHILDREN; ++b) cost[b] = whole ? leaf : tree->costs[(CHILDREN - 1) * node + b - 1];
}

// best[b], b = 2 … CHILDREN: the cost of a node that is opened, with b roots for the subtrees of its children;
// shares[b] of them are the left child's.
static inline void share_roots(const Planned *tree, int left, int right, float *best, uint *shares) {
    float from_left[CHILDREN], from_right[CHILDREN];
    costs_of(tree, left, from_left);
    costs_of(tree, right, from_right);
    for (int b = 2; b <= CHILDREN; ++b) {
        best[b] = INFINITY;
        shares[b] = 1;
        for (int k = 1; k < b; ++k) {
            float cost = from_left[k] + from_right[b - k];
            shares[b] = cost < best[b] ? k : shares[b];
            best[b] = cost < best[b] ? cost : best[b];
        }
    }
}

// Plan a node from the plans of its children, and compute its costs. The root is never a leaf.
static inline uint plan_node(const Planned *tree, int node, int root) {
    int left = tree->nodes[node].left, right = tree->nodes[node].right;
    uint below[2] = {plan_of(&tree->primitives, tree->plans, left), plan_of(&tree->primitives, tree->plans, right)};
    uint count = COUNT(below[0]) + COUNT(below[1]), plan = (below[0] | below[1]) & (HAS_TRIANGLES | HAS_SPHERES);
    plan |= COUNTED(count < MANY_COUNTED ? count : MANY_COUNTED);
    float met = chance(node_box(&tree->primitives, tree->nodes, node), &tree->world), leaf = INFINITY;
    bool may_be_leaf = node != root && fits_leaf(plan);
    if (may_be_leaf) leaf = fma(met, tests_of((plan & HAS_SPHERES) != 0, count), 0.0f);
    if (PACK > 1 && may_be_leaf) {
        float opened = leaf_costs(tree, left).y + leaf_costs(tree, right).y;
        tree->leaves[node] = (float2)(leaf, opened < leaf ? opened : leaf);
        if (opened >= (1.0f - WORTHWHILE) * leaf) return plan | IS_LEAF | WHOLE;
    }
    float best[CHILDREN + 1];
    uint shares[CHILDREN + 1];
    share_roots(tree, left, right, best, shares);
    best[1] = met + best[CHILDREN];
    if (leaf <= best[1]) {
        best[1] = leaf;
        plan |= IS_LEAF;
    }
    for (int b = 1; b < CHILDREN; ++b) {
        bool opened = best[b] < best[1];
        tree->costs[(CHILDREN - 1) * node + b - 1] = opened ? best[b] : best[1];
        if (opened) plan |= shares[b] << 3 * (b - 2);
    }
    if (PACK > 1 && may_be_leaf) tree->leaves[node].y = best[CHILDREN - 1] < best[1] ? best[CHILDREN - 1] : best[1];
    return plan | shares[CHILDREN] << 3 * (CHILDREN - 2);
}

static inline void prefetch_planned(const Planned *tree, int node) {
    if (node < 0) return;
    PREFETCH(tree->plans + node, 4)
    PREFETCH(tree->leaves + node, 8)
}

// Plan `count` nodes from `node` on, whose children are planned.
kernel void plan_nodes(uint count, uint block, PRIMITIVE_PARAMETERS, global const BinaryNode *nodes, uint node,
                       uint root, const World world, global uint *plans, global float *costs, global float2 *leaves) {
    Planned tree = {PRIMITIVE_ARGUMENTS, nodes, plans, costs, leaves, world};
    uint first = (uint)get_global_id(0) * block, end = first + block < count ? first + block : count;
    for (uint i = node + first; i < node + end; ++i) {
        if (i + PLANS_AHEAD < node + end) {
            prefetch_planned(&tree, nodes[i + PLANS_AHEAD].left);
            prefetch_planned(&tree, nodes[i + PLANS_AHEAD].right);
        }
        plans[i] = plan_node(&tree, i, root);
    }
}
