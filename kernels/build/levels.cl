// Sort a binary BVH by level, the deepest first and the root last, with the parent, depth and height of every node.
// Entries of list: the old node indices, from the root down, so that the new index of list[k] is root − k.
#include "build/binary.cl"

// The index of a child in arrays over all nodes, `root` + 1 of them, followed by all primitives.
static inline uint place_of(int child, uint root) { return child >= 0 ? (uint)child : root + 1 + (uint)~child; }

#define LEVEL(depth, height) ((uint)(depth) | (uint)(height) << 16)
#define DEPTH(level) ((level) & 0xffff)
#define HEIGHT(level) ((level) >> 16)

// For each block of a level that starts at list[start]: the number of children that are nodes. The first level is the
// root.
kernel void count_below(uint count, uint block, global const BinaryNode *nodes, uint root, global uint *list, uint start,
                        global uint *counts) {
    uint me = get_global_id(0), blocks = (count + block - 1) / block;
    if (me >= blocks) return;
    uint first = me * block, end = first + block < count ? first + block : count, below = 0;
    if (start == 0) list[0] = root;
    for (uint i = first; i < end; ++i) {
        global const BinaryNode *node = nodes + list[start + i];
        below += (node->left >= 0) + (node->right >= 0);
    }
    counts[me] = below;
}

// Write the nodes of the level, and append the list of the next level. offsets: the counts, scanned.
kernel void write_binary_level(uint count, uint block, global const BinaryNode *nodes, uint root, global uint *list,
                               uint start, uint depth, global const uint *offsets, global BinaryNode *sorted,
                               global uint *parents, global uint *levels) {
    uint me = get_global_id(0), blocks = (count + block - 1) / block;
    if (me >= blocks) return;
    uint first = me * block, end = first + block < count ? first + block : count;
    uint next = start + count + offsets[me];
    for (uint i = first; i < end; ++i) {
        uint index = root - start - i;
        BinaryNode node = nodes[list[start + i]];
        int children[2] = {node.left, node.right};
        for (int k = 0; k < 2; ++k) {
            if (children[k] >= 0) {
                list[next] = children[k];
                children[k] = root - next++;
            }
            parents[place_of(children[k], root)] = index;
        }
        node.left = children[0];
        node.right = children[1];
        sorted[index] = node;
        levels[index] = LEVEL(depth, 0);
    }
}

static inline uint height_of(global const uint *levels, int child) { return child >= 0 ? HEIGHT(levels[child]) : 0; }

// Compute boxes and heights of `count` nodes from `node` on, whose children have theirs.
kernel void refit_nodes(uint count, uint block, PRIMITIVE_PARAMETERS, global BinaryNode *nodes, uint node,
                        global uint *levels) {
    Primitives primitives = PRIMITIVE_ARGUMENTS;
    uint first = (uint)get_global_id(0) * block, end = first + block < count ? first + block : count;
    for (uint i = node + first; i < node + end; ++i) {
        int left = nodes[i].left, right = nodes[i].right;
        Box box = box_union(node_box(&primitives, nodes, left), node_box(&primitives, nodes, right));
        uint a = height_of(levels, left), b = height_of(levels, right);
        vstore3(box.lo, 0, nodes[i].lo);
        vstore3(box.hi, 0, nodes[i].hi);
        levels[i] += LEVEL(0, 1 + (a > b ? a : b));
    }
}
