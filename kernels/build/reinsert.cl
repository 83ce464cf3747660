// Optimise the binary BVH by reinsertion: subtrees are removed and inserted elsewhere if that reduces the total area of
// all nodes (Meister and Bittner 2017, "Parallel Reinsertion for Bounding Volume Hierarchy Optimization").
//
// For each subtree below the topmost nodes the best new position is searched. Then moves that would touch a common node
// compete, and only the one with the largest gain is kept. With 32-bit atomics that takes two steps, first the gain and
// then the index of the move, so that the same moves win whatever the order of execution.
#include "build/levels.cl"

#define WAITING 96       // capacity for subtrees still to be searched; others are skipped
#define VISITS 256       // maximum number of positions tried per subtree
#define ROUNDING 5e-7f   // relative to the area of all changes; covers the rounding of sums and differences of areas

typedef struct {
    global BinaryNode *nodes;
    global const uint *parents, *levels;
    uint root;
} Binary;

#define BINARY_PARAMETERS global BinaryNode *nodes, global const uint *parents, global const uint *levels, uint root
#define BINARY_ARGUMENTS {nodes, parents, levels, root}

static inline int parent_of(const Binary *tree, int child) { return (int)tree->parents[place_of(child, tree->root)]; }

static inline int sibling_of(const Binary *tree, int child, int parent) {
    return tree->nodes[parent].left == child ? tree->nodes[parent].right : tree->nodes[parent].left;
}

// Whether a leaf would become deeper than `deepest`. That bounds a single move; since moves made together have disjoint
// paths, at most every second node above a leaf can get a new parent, so none gets deeper than 1.5 deepest.
static inline bool too_deep(const Binary *tree, int moved, int target, uint deepest) {
    uint a = height_of(tree->levels, moved), b = height_of(tree->levels, target);
    return DEPTH(tree->levels[parent_of(tree, target)]) + 2 + (a > b ? a : b) > deepest;
}

// Search the best position in the subtree `top`, which does not hold `moved`, of box `box`. saved: the area saved by
// its removal, less ROUNDING. The nodes on the path down grow; a subtree is skipped if even a
// new parent of area `area`, the least possible, would not pay off.
static inline void search(const Primitives *primitives, const Binary *tree, int top, int pivot, Box box, float saved,
                          uint deepest, int *visits, Move *best) {
    int waiting[WAITING], count = 1;
    float left[WAITING], area = half_area(box);
    waiting[0] = top;
    left[0] = saved;
    while (count > 0 && *visits < VISITS) {
        int node = waiting[--count];
        float before = left[count];
        if (before - area <= best->gain) continue;
        ++*visits;
        Box old = node_box(primitives, tree->nodes, node);
        float joint = half_area(box_union(old, box)), after = before - (joint - half_area(old));
        if (before - joint > best->gain && !too_deep(tree, best->moved, node, deepest)) {
            *best = (Move){best->moved, node, pivot, before - joint};
        }
        if (node >= 0 && after - area > best->gain && count + 2 <= WAITING) {
            waiting[count] = tree->nodes[node].left;
            left[count++] = after;
            waiting[count] = tree->nodes[node].right;
            left[count++] = after;
        }
    }
}

// Moves 2k and 2k + 1 are those of the children of node root − k. A child of the root stays where it is.
kernel void find_moves(uint count, uint block, PRIMITIVE_PARAMETERS, BINARY_PARAMETERS, uint deepest, global Move *moves) {
    Primitives primitives = PRIMITIVE_ARGUMENTS;
    Binary tree = BINARY_ARGUMENTS;
    uint first = (uint)get_global_id(0) * block, end = first + block < count ? first + block : count;
    for (uint i = first; i < end; ++i) {
        int parent = root - i / 2, moved = i & 1 ? nodes[parent].right : nodes[parent].left;
        int pivot = parent, beside = sibling_of(&tree, moved, parent), visits = 0;
        Box box = node_box(&primitives, nodes, moved), rest = node_box(&primitives, nodes, beside);
        float area = half_area(node_box(&primitives, nodes, parent)), saved = area;
        Move best = {moved, moved, pivot, 0.0f};
        while (parent != root) {
            search(&primitives, &tree, beside, pivot, box, fma(-ROUNDING, area, saved), deepest, &visits, &best);
            if (pivot == root || visits >= VISITS) break;
            if (pivot != parent) {
                rest = box_union(rest, node_box(&primitives, nodes, beside));
                saved += area - half_area(rest);
            }
            int below = pivot;
            pivot = parent_of(&tree, below);
            beside = sibling_of(&tree, below, pivot);
            area = half_area(node_box(&primitives, nodes, pivot));
        }
        moves[i] = best;
    }
}

// Steps in which moves compete for the nodes that they touch: those whose links change, and those on the paths from
// both subtrees to the pivot, whose boxes change. gain: per node the largest gain of the moves that touch it, infinite
// once it is assigned. owner: the move that owns it, 0 for none. Winners are marked by a negative gain.
#define GIVE_UP 0  // moves that need an assigned node drop out
#define CLAIM 1    // every node receives the largest gain
#define OWN 2      // and the last move that has it
#define WIN 3      // moves that own all their nodes win
#define SETTLE 4   // winners keep their nodes, all others release theirs

// Whether the move can get the node, or has it.
static inline bool compete(int step, const Move *move, uint name, global uint *gain, global uint *owner) {
    uint mine = as_uint(move->gain);
    if (step == GIVE_UP) return *gain != as_uint(INFINITY);
    if (step == CLAIM) atomic_max(gain, mine);
    if (step == OWN && *gain == mine) atomic_max(owner, name);
    if (step == SETTLE && atomic_cmpxchg(owner, name, 0) == name) *gain = move->gain < 0.0f ? as_uint(INFINITY) : 0;
    return step == WIN && *owner == name;
}

kernel void match_moves(uint count, uint block, BINARY_PARAMETERS, uint step, global Move *moves, global uint *gains,
                        global uint *owners) {
    Binary tree = BINARY_ARGUMENTS;
    uint first = (uint)get_global_id(0) * block, end = first + block < count ? first + block : count;
    for (uint i = first; i < end; ++i) {
        Move move = moves[i];
        if (move.gain == 0.0f || (move.gain < 0.0f && step != SETTLE)) continue;
        int parent = parent_of(&tree, move.moved);
        int starts[6] = {move.moved, move.target, parent, sibling_of(&tree, move.moved, parent), parent_of(&tree, parent),
                         parent_of(&tree, move.target)};
        bool all = true;
        for (int k = 0; k < 6; ++k) {
            int node = starts[k];
            do {
                uint place = place_of(node, root);
                all &= compete(step, &move, i + 1, gains + place, owners + place);
                node = (int)parents[place];
            } while (k < 2 && node != move.pivot);
        }
        if (step == GIVE_UP && !all) moves[i].gain = 0.0f;
        if (step == WIN && all) moves[i].gain = -move.gain;
    }
}

static inline void replace_child(global BinaryNode *node, int old, int new) {
    if (node->left == old) node->left = new;
    else node->right = new;
}

// Change the links; boxes are updated when the BVH is refitted.
kernel void make_moves(uint count, uint block, BINARY_PARAMETERS, global const Move *moves) {
    Binary tree = BINARY_ARGUMENTS;
    uint first = (uint)get_global_id(0) * block, end = first + block < count ? first + block : count;
    for (uint i = first; i < end; ++i) {
        Move move = moves[i];
        if (move.gain >= 0.0f) continue;
        int parent = parent_of(&tree, move.moved);
        replace_child(nodes + parent_of(&tree, parent), parent, sibling_of(&tree, move.moved, parent));
        replace_child(nodes + parent_of(&tree, move.target), move.target, parent);
        nodes[parent].left = move.target;
        nodes[parent].right = move.moved;
    }
}
