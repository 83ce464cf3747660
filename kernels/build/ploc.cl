// Bottom-up build of a binary BVH: parallel locally-ordered clustering (Meister and Bittner 2018, "Parallel
// Locally-Ordered Clustering for Bounding Volume Hierarchy Construction"; rounds as in Benthin et al. 2022, "PLOC++").
//
// Clusters are in Morton order. In each round every cluster searches RADIUS places to both sides for its nearest
// neighbour, and mutual nearest neighbours are merged. A cluster is a column of seven rows, `pitch` apart: its box (lo
// x, y, z, hi x, y, z), and as an integer its node << 4 | the number of its primitives, at most MANY; ~p is primitive
// p. RADIUS columns at infinite distance pad both ends. A round that merges fewer than one cluster in SLOW is followed
// by one that merges all neighbours, so that depth and time are bounded for any input, nested boxes included.
#include "build/primitives.cl"
#include "build/tiles.cl"
#include "core/mask.cl"

#define RADIUS 8
#define FAR 4e18f
#define MANY 15
#define CLUSTER(node, count) ((int)((uint)(node) << 4) | (int)(count))
#define NODE(cluster) ((cluster) >> 4)

// The distance of two clusters: the area of their common box, less a fraction of their own areas. If both fit into one
// leaf its cost replaces theirs; above leaves, these fractions gave the cheapest BVHs of those tried, with few children
// and with many. (The area alone gives BVHs that cost 3 to 4 % more.)
#define SAVED_IN_LEAF 1.0f
#define SAVED_ABOVE (CHILDREN > 2 ? 0.75f : 0.4f)

static inline Box cluster_box(global const float *clusters, uint pitch, uint i) {
    clusters += RADIUS + i;
    return (Box){{clusters[0], clusters[pitch], clusters[2 * pitch]},
                 {clusters[3 * pitch], clusters[4 * pitch], clusters[5 * pitch]}};
}

static inline int cluster_node(global const float *clusters, uint pitch, uint i) {
    return ((global const int *)clusters)[6 * pitch + RADIUS + i];
}

static inline void put_cluster(global float *clusters, uint pitch, int i, Box box, int node) {
    clusters += RADIUS + i;
    clusters[0] = box.lo.x;
    clusters[pitch] = box.lo.y;
    clusters[2 * pitch] = box.lo.z;
    clusters[3 * pitch] = box.hi.x;
    clusters[4 * pitch] = box.hi.y;
    clusters[5 * pitch] = box.hi.z;
    ((global int *)clusters)[6 * pitch] = node;
}

static inline void put_margins(global float *clusters, uint pitch, int count) {
    Box far = {(float3)(FAR), (float3)(FAR)};
    for (int i = -RADIUS; i < RADIUS; ++i) put_cluster(clusters, pitch, i < 0 ? i : count + i, far, MANY);
}

kernel void first_clusters(uint count, uint block, PRIMITIVE_PARAMETERS, global float *clusters, uint pitch) {
    Primitives primitives = PRIMITIVE_ARGUMENTS;
    uint first = (uint)get_global_id(0) * block, end = first + block < count ? first + block : count;
    if (first == 0) put_margins(clusters, pitch, count);
    for (uint i = first; i < end; ++i) put_cluster(clusters, pitch, i, primitive_box(&primitives, i), CLUSTER(~i, 1));
}

// Distances from a cluster to the eight in columns from `row` on.
static inline float8 distances(global const float *row, uint pitch, Box box, float area, int size) {
    float8 lo_x = vload8(0, row), lo_y = vload8(0, row + pitch), lo_z = vload8(0, row + 2 * pitch);
    float8 hi_x = vload8(0, row + 3 * pitch), hi_y = vload8(0, row + 4 * pitch), hi_z = vload8(0, row + 5 * pitch);
    int8 sizes = vload8(0, (global const int *)(row + 6 * pitch)) & MANY;
    float8 x = hi_x - lo_x, y = hi_y - lo_y, z = hi_z - lo_z;
    float8 areas = fma(x, y + z, y * z) + area;
    x = (hi_x > box.hi.x ? hi_x : (float8)(box.hi.x)) - (lo_x < box.lo.x ? lo_x : (float8)(box.lo.x));
    y = (hi_y > box.hi.y ? hi_y : (float8)(box.hi.y)) - (lo_y < box.lo.y ? lo_y : (float8)(box.lo.y));
    z = (hi_z > box.hi.z ? hi_z : (float8)(box.hi.z)) - (lo_z < box.lo.z ? lo_z : (float8)(box.lo.z));
    float8 saved = PACK > 1 ? (sizes + size <= LEAF_SIZE ? (float8)(SAVED_IN_LEAF) : (float8)(SAVED_ABOVE)) : SAVED_ABOVE;
    return fma(-saved, areas, fma(x, y + z, y * z));
}

// The offset from cluster i to its nearest neighbour. Ties are broken by the exclusive or of both indices, which orders
// all pairs, so the nearest pair of all is always mutual, and neighbours pair up if all distances are equal. With
// `forced` neighbours pair up whatever their boxes: such rounds halve the number of clusters.
static inline int nearest_of(global const float *clusters, uint pitch, uint count, uint forced, uint i) {
    if (forced) return (i ^ 1) < count ? (int)(i ^ 1) - (int)i : 0;
    Box box = cluster_box(clusters, pitch, i);
    float area = half_area(box);
    int size = cluster_node(clusters, pitch, i) & MANY;
    float8 before = distances(clusters + i, pitch, box, area, size);
    float8 after = distances(clusters + i + RADIUS + 1, pitch, box, area, size);
    float8 eight = before < after ? before : after;
    float4 four = eight.lo < eight.hi ? eight.lo : eight.hi;
    float2 two = four.lo < four.hi ? four.lo : four.hi;
    float least = two.x < two.y ? two.x : two.y;
    uint equal = mask_bits(before == least) | mask_bits(after == least) << RADIUS;
    uint first_of_equal = 0xffffffff;
    for (; equal; equal &= equal - 1) {
        int slot = first_bit(equal);
        uint other = i - RADIUS + slot + (slot >= RADIUS);
        first_of_equal = (other ^ i) < first_of_equal ? other ^ i : first_of_equal;
    }
    return (int)(first_of_equal ^ i) - (int)i;
}

// The offset to the cluster that i is merged with, 0 if it stays alone.
static inline int partner(global const char *nearest, uint i) {
    int step = nearest[i];
    return nearest[i + step] == -step ? step : 0;
}

// Write cluster i, merged with that `step` places on if `step` is above 0, to `place` in the next round; the new node is
// `node`.
static inline void join(uint i, int step, global const float *clusters, uint pitch, global float *next, uint next_pitch,
                        uint place, global BinaryNode *nodes, uint node) {
    Box box = cluster_box(clusters, pitch, i);
    int left = cluster_node(clusters, pitch, i);
    if (step > 0) {
        int right = cluster_node(clusters, pitch, i + step), size = (left & MANY) + (right & MANY);
        box = box_union(box, cluster_box(clusters, pitch, i + step));
        vstore3(box.lo, 0, nodes[node].lo);
        vstore3(box.hi, 0, nodes[node].hi);
        nodes[node].left = NODE(left);
        nodes[node].right = NODE(right);
        left = CLUSTER(node, size < MANY ? size : MANY);
    }
    put_cluster(next, next_pitch, place, box, left);
}

// Of a cluster, x: whether it remains; y: whether it is the first of a pair that is merged.
static inline uint2 fate(int step) { return (uint2)(step >= 0, step > 0); }

kernel void nearest_clusters(uint count, uint block, global const float *clusters, uint pitch, uint forced,
                             global char *nearest) {
    uint first = (uint)get_global_id(0) * block, end = first + block < count ? first + block : count;
    for (uint i = first; i < end; ++i) nearest[i] = nearest_of(clusters, pitch, count, forced, i);
}

// In each tile: counts[tile] clusters that remain, counts[tiles + tile] pairs that are merged.
kernel void count_pairs(uint count, uint block, global const char *nearest, global uint *counts) {
    local uint2 counted[TILE_ITEMS];
    TILE_RANGE
    uint2 mine = {0, 0};
    for (uint i = first + me; i < end; i += items) mine += fate(partner(nearest, i));
    counted[me] = mine;
    barrier(CLK_LOCAL_MEM_FENCE);
    if (me > 0) return;
    for (uint k = 1; k < items; ++k) mine += counted[k];
    counts[tile] = mine.x;
    counts[tiles + tile] = mine.y;
}

// Write the clusters of the next round; new nodes are numbered from `node` on.
kernel void join_pairs(uint count, uint block, global const char *nearest, global const uint *offsets,
                       global const uint *totals, global const float *clusters, uint pitch, global float *next,
                       uint next_pitch, global BinaryNode *nodes, uint node) {
    local uint2 fates[TILE_ITEMS];
    TILE_RANGE
    if (tile == 0 && me == 0) put_margins(next, next_pitch, totals[0]);
    uint place = offsets[tile];
    node += offsets[tiles + tile];
    for (uint start = first; start < end; start += items) {
        uint i = start + me;
        int step = i < end ? partner(nearest, i) : -1;
        fates[me] = fate(step);
        barrier(CLK_LOCAL_MEM_FENCE);
        uint2 before = {place, node};
        for (uint k = 0; k < items; ++k) {
            before += k < me ? fates[k] : (uint2)(0, 0);
            place += fates[k].x;
            node += fates[k].y;
        }
        if (step >= 0) join(i, step, clusters, pitch, next, next_pitch, before.x, nodes, before.y);
        barrier(CLK_LOCAL_MEM_FENCE);
    }
}

// All further rounds in one work-group: with few clusters a round is faster than the launches of its kernels. rounds[0]
// receives their number, and rounds[1] and on the number of nodes that each of them made.
kernel void last_rounds(uint count, uint forced, global char *nearest, global float *clusters, uint pitch,
                        global float *next, uint next_pitch, global BinaryNode *nodes, uint node, global uint *rounds) {
    local uint2 counts[SCAN_ITEMS];
    uint me = get_local_id(0), items = get_local_size(0), made = 0;
    while (count > 1) {
        uint share = (count + items - 1) / items, first = me * share < count ? me * share : count;
        uint end = first + share < count ? first + share : count;
        for (uint i = first; i < end; ++i) nearest[i] = nearest_of(clusters, pitch, count, forced, i);
        barrier(CLK_GLOBAL_MEM_FENCE);
        uint2 mine = {0, 0};
        for (uint i = first; i < end; ++i) mine += fate(partner(nearest, i));
        counts[me] = mine;
        barrier(CLK_LOCAL_MEM_FENCE);
        uint2 before = {0, node}, all = {0, 0};
        for (uint i = 0; i < items; ++i) {
            before += i < me ? counts[i] : (uint2)(0, 0);
            all += counts[i];
        }
        if (me == 0) {
            put_margins(next, next_pitch, all.x);
            rounds[++made] = all.y;
        }
        for (uint i = first; i < end; ++i) {
            int step = partner(nearest, i);
            if (step >= 0) join(i, step, clusters, pitch, next, next_pitch, before.x, nodes, before.y);
            before += fate(step);
        }
        barrier(CLK_GLOBAL_MEM_FENCE | CLK_LOCAL_MEM_FENCE);
        forced = all.y * SLOW < count;
        count = all.x;
        node += all.y;
        global float *done = clusters;
        uint done_pitch = pitch;
        clusters = next;
        pitch = next_pitch;
        next = done;
        next_pitch = done_pitch;
    }
    if (me == 0) rounds[0] = made;
}
