// A binary tree from the bottom up: parallel locally-ordered clustering (Meister and Bittner 2018, "Parallel
// Locally-Ordered Clustering for Bounding Volume Hierarchy Construction"; rounds as in Benthin et al. 2022, "PLOC++").
//
// Clusters lie in Morton order. In each round every cluster looks RADIUS places to both sides for the one that makes the
// smallest box with it, and those that chose each other become one. Boxes of clusters are six rows of floats (lo x, y,
// z, hi x, y, z), `pitch` apart, with RADIUS infinite boxes before the first and after the last.
#include "build/morton.cl"
#include "build/sort.cl"
#include "mask.cl"

#define RADIUS 8
#define FEW 32   // so few clusters are joined by a single work-item

typedef struct { global float *boxes; global int *nodes; uint pitch; } Clusters;

static inline Box cluster_box(const Clusters *clusters, uint i) {
    Box box;
    for (int k = 0; k < 3; ++k) {
        box.lo[k] = clusters->boxes[k * clusters->pitch + RADIUS + i];
        box.hi[k] = clusters->boxes[(k + 3) * clusters->pitch + RADIUS + i];
    }
    return box;
}

static inline void put_cluster(const Clusters *clusters, uint i, Box box, int node) {
    for (int k = 0; k < 3; ++k) {
        clusters->boxes[k * clusters->pitch + RADIUS + i] = box.lo[k];
        clusters->boxes[(k + 3) * clusters->pitch + RADIUS + i] = box.hi[k];
    }
    clusters->nodes[i] = node;
}

static inline void put_margin(const Clusters *clusters, uint row) {
    for (uint i = row; i < row + RADIUS; ++i) {
        for (int k = 0; k < 3; ++k) {
            clusters->boxes[k * clusters->pitch + i] = -INFINITY;
            clusters->boxes[(k + 3) * clusters->pitch + i] = INFINITY;
        }
    }
}

static inline void join_clusters(global BinaryNode *nodes, global int *parents, uint node, Box box, int left, int right,
                                 uint interior) {
    for (int k = 0; k < 3; ++k) {
        nodes[node].lo[k] = box.lo[k];
        nodes[node].hi[k] = box.hi[k];
    }
    nodes[node].left = left;
    nodes[node].right = right;
    parents[left >= 0 ? left : (int)interior + ~left] = node;
    parents[right >= 0 ? right : (int)interior + ~right] = node;
}

kernel void first_clusters(uint count, uint block, PRIMITIVE_PARAMETERS, global const uint *order,
                           global float *boxes, global int *cluster_nodes, uint pitch) {
    Primitives primitives = PRIMITIVE_ARGUMENTS;
    Clusters clusters = {boxes, cluster_nodes, pitch};
    uint first = (uint)get_global_id(0) * block, end = first + block < count ? first + block : count;
    if (first == 0) put_margin(&clusters, 0);
    if (first < count && end == count) put_margin(&clusters, RADIUS + count);
    for (uint i = first; i < end; ++i) put_cluster(&clusters, i, primitive_box(&primitives, order[i]), ~(int)order[i]);
}

// Half areas of the boxes around `box` and each of the eight clusters in `row`.
static inline float8 joint_areas(global const float *boxes, uint pitch, uint row, Box box) {
    float8 size[3];
    for (int k = 0; k < 3; ++k) {
        float8 lo = vload8(0, boxes + k * pitch + row), hi = vload8(0, boxes + (k + 3) * pitch + row);
        size[k] = (hi > box.hi[k] ? hi : (float8)(box.hi[k])) - (lo < box.lo[k] ? lo : (float8)(box.lo[k]));
    }
    return fma(size[0], size[1] + size[2], size[1] * size[2]);
}

// The best partner of each cluster. Of equal ones the first by the exclusive or of both indices: that is an order of all
// pairs, so the best pair of all chooses itself, and where all are equal neighbours pair up.
kernel void nearest_clusters(uint count, uint block, global const float *boxes, uint pitch, global uint *nearest) {
    uint first = (uint)get_global_id(0) * block, end = first + block < count ? first + block : count;
    Clusters clusters = {(global float *)boxes, 0, pitch};
    for (uint i = first; i < end; ++i) {
        Box box = cluster_box(&clusters, i);
        float8 before = joint_areas(boxes, pitch, i, box), after = joint_areas(boxes, pitch, i + RADIUS + 1, box);
        float8 eight = before < after ? before : after;
        float4 four = eight.lo < eight.hi ? eight.lo : eight.hi;
        float2 two = four.lo < four.hi ? four.lo : four.hi;
        float least = two.x < two.y ? two.x : two.y;
        uint equal = mask_bits(before == least) | mask_bits(after == least) << RADIUS;
        uint best = 0, smallest = 0xffffffff;
        for (; equal; equal &= equal - 1) {
            uint slot = first_bit(equal), other = i - RADIUS + slot + (slot >= RADIUS);
            if (other < count && (other ^ i) < smallest) {
                smallest = other ^ i;
                best = other;
            }
        }
        nearest[i] = best;
    }
}

// Neighbours by index, whatever their boxes: the rounds that this serves halve the clusters.
kernel void pair_clusters(uint count, uint block, global uint *nearest) {
    uint first = (uint)get_global_id(0) * block, end = first + block < count ? first + block : count;
    for (uint i = first; i < end; ++i) nearest[i] = (i ^ 1) < count ? i ^ 1 : i;
}

// In each block: counts[block] clusters that stay, counts[blocks + block] pairs that are joined.
kernel void count_pairs(uint count, uint block, global const uint *nearest, global uint *counts) {
    uint me = get_global_id(0), blocks = (count + block - 1) / block;
    if (me >= blocks) return;
    uint first = me * block, end = first + block < count ? first + block : count;
    uint stay = 0, pairs = 0;
    for (uint i = first; i < end; ++i) {
        uint other = nearest[i];
        bool mutual = other != i && nearest[other] == i;
        stay += !(mutual && other < i);
        pairs += mutual && i < other;
    }
    counts[me] = stay;
    counts[blocks + me] = pairs;
}

// The clusters of the next round; new nodes are numbered from `node` on.
kernel void join_pairs(uint count, uint block, global const uint *nearest, global const uint *offsets,
                       global const uint *totals, global const float *boxes, global const int *cluster_nodes, uint pitch,
                       global float *next_boxes, global int *next_nodes, global BinaryNode *nodes, global int *parents,
                       uint node, uint interior) {
    uint me = get_global_id(0), blocks = (count + block - 1) / block;
    if (me >= blocks) return;
    uint first = me * block, end = first + block < count ? first + block : count;
    Clusters now = {(global float *)boxes, (global int *)cluster_nodes, pitch}, next = {next_boxes, next_nodes, pitch};
    uint place = offsets[me];
    node += offsets[blocks + me];
    if (me == 0) {
        put_margin(&next, 0);
        put_margin(&next, RADIUS + totals[0]);
    }
    for (uint i = first; i < end; ++i) {
        uint other = nearest[i];
        bool mutual = other != i && nearest[other] == i;
        if (!mutual) put_cluster(&next, place++, cluster_box(&now, i), cluster_nodes[i]);
        if (mutual && i < other) {
            Box box = box_union(cluster_box(&now, i), cluster_box(&now, other));
            join_clusters(nodes, parents, node, box, cluster_nodes[i], cluster_nodes[other], interior);
            put_cluster(&next, place++, box, (int)node++);
        }
    }
}

// The last FEW clusters, or fewer: the pair with the smallest box of all, again and again.
kernel void join_few(uint count, uint block, global float *boxes, global int *cluster_nodes, uint pitch,
                     global BinaryNode *nodes, global int *parents, uint node, uint interior) {
    if (get_global_id(0) > 0) return;
    Clusters clusters = {boxes, cluster_nodes, pitch};
    Box box[FEW];
    int left[FEW];
    for (uint i = 0; i < count; ++i) {
        box[i] = cluster_box(&clusters, i);
        left[i] = cluster_nodes[i];
    }
    for (; count > 1; --count) {
        uint a = 0, b = 1;
        float least = INFINITY;
        for (uint i = 0; i < count; ++i) {
            for (uint j = i + 1; j < count; ++j) {
                float area = half_area(box_union(box[i], box[j]));
                if (area < least) {
                    least = area;
                    a = i;
                    b = j;
                }
            }
        }
        box[a] = box_union(box[a], box[b]);
        join_clusters(nodes, parents, node, box[a], left[a], left[b], interior);
        left[a] = (int)node++;
        box[b] = box[count - 1];
        left[b] = left[count - 1];
    }
    parents[node - 1] = -1;
}
