// Compressed 8-wide BVH for GPUs (Ylitie, Karras and Laine 2017, "Efficient Incoherent Ray Traversal on GPUs Through
// Compressed Wide BVHs"): 80-byte nodes, with boxes of eight bits per plane.
//
// The children of a node that a ray hits are one word: a bit each for child nodes (31 … 24) and for primitives (23 …
// 0). Bits of nodes are in the order in which a ray of this octant visits the slots, so the next one is the highest bit
// and nothing is sorted. A group is the index of the first child and such bits; the rest of a node group is pushed on a
// stack, at most one group per level, whose size the host computed for this BVH, so that it cannot overflow. In the top
// level of a two-level BVH the primitives of a node are instances, which form a group as well; the rest of it, below an
// instance's BVH on the stack, is marked LEAVE.
//
// Watertight, as geometry/box.cl. A plane at p + q·step is at q·step + (p − origin) relative to the ray: q·step is
// exact, and the rounding of the sum is within the margin of SLAB_PAD. The roundings of p − origin, and of plane − p
// during the build, are below 3 ulps of p − origin; ORIGIN_PAD is 4. The product with 1/direction stays separate, at
// one operation per plane, so that zeros and infinities behave as they do there.
#include "traverse/slab_rays.cl"
#include UPPER_LEVEL

typedef struct { float step[3], near[3], far[3]; } Grid;   // the step, and p − origin for near and far planes
typedef struct { uint first, bits; } Group;

static inline Grid node_grid(const SlabRay *ray, uint4 frame) {
    Grid grid;
    float p[3] = {as_float(frame.x), as_float(frame.y), as_float(frame.z)};
    for (int axis = 0; axis < 3; ++axis) {
        grid.step[axis] = as_float((frame.w >> 8 * axis & 0xff) << 23);
        float base = p[axis] - ray->origin[axis];
        float pad = (base < 0.0f ? -base : base) * (ray->backward[axis] ? -ORIGIN_PAD : ORIGIN_PAD);
        grid.near[axis] = base - pad;
        grid.far[axis] = base + pad;
    }
    return grid;
}

// Intersect four children of a node, one byte each in meta and in each axis of low and high; return the bits of those
// hit.
static inline uint enter_four(const SlabRay *ray, const Grid *grid, uint order, float t_max, uint meta,
                              const uint low[3], const uint high[3]) {
    float4 t_near = FIRST_T(ray), t_far = t_max;
    for (int axis = 0; axis < 3; ++axis) {
        uint near_bytes = ray->backward[axis] ? high[axis] : low[axis];
        uint far_bytes = ray->backward[axis] ? low[axis] : high[axis];
        float4 near = (convert_float4(as_uchar4(near_bytes)) * grid->step[axis] + grid->near[axis]) * ray->near[axis];
        float4 far = (convert_float4(as_uchar4(far_bytes)) * grid->step[axis] + grid->far[axis]) * ray->far[axis];
        t_near = fmax(near, t_near);   // these drop NaN, as box.cl's comparisons do, and are one instruction on GPUs
        t_far = fmin(far, t_far);
    }
    // For nodes the low bits of meta are 24 + slot, permuted to the ray's order; for leaves they are below 24 and
    // unchanged.
    uint nodes = (meta & meta << 1 & 0x10101010) >> 4;
    uint4 place = convert_uint4(as_uchar4((meta ^ nodes * order) & 0x1f1f1f1f));
    uint4 bits = convert_uint4(as_uchar4(meta >> 5 & 0x07070707)) << place & as_uint4(t_near <= t_far);
    return bits.x | bits.y | bits.z | bits.w;
}

static inline void enter_node(const SlabRay *ray, global const Node *node, uint order, float t_max, Group *nodes,
                              Group *primitives) {
    global const uint4 *words = (global const uint4 *)node;
    uint4 frame = words[0], links = words[1], a = words[2], b = words[3], c = words[4];
    uint low[2][3] = {{a.x, a.z, b.x}, {a.y, a.w, b.y}}, high[2][3] = {{b.z, c.x, c.z}, {b.w, c.y, c.w}};
    Grid grid = node_grid(ray, frame);
    uint bits = enter_four(ray, &grid, order, t_max, links.z, low[0], high[0])
              | enter_four(ray, &grid, order, t_max, links.w, low[1], high[1]);
    *nodes = (Group){links.x, (bits & 0xff000000) | frame.w >> 24};   // slots that are nodes, to index children
    *primitives = (Group){links.y, bits & 0x00ffffff};
}

static inline void hit_primitive(const Scene *scene, const LeafRay *ray, int i, const bool stop_at_first, Hit *hit) {
#if LEAF_SPHERES
    int sphere = i - scene->counts.triangles;
#if TRIANGLES
    if (sphere >= 0)
#endif
    {
        VISIT(spheres, sphere);
        hit_spheres(ray, RECORD(scene->leaf_spheres, sphere), 1, hit);
        return;
    }
#endif
#if TRIANGLES
    VISIT(tests, i);
    hit_triangles(ray, RECORD(scene->leaf_triangles, i), stop_at_first, hit);
#endif
}

// The octant into which a ray runs, a bit per axis.
static inline uint octant(const SlabRay *ray) {
    return (ray->backward[0] ? 0 : 1) | (ray->backward[1] ? 0 : 2) | (ray->backward[2] ? 0 : 4);
}

static inline Hit traverse(const Scene *scene, const TreeRays *rays, const Ray *ray, int lane, const bool stop_at_first,
                           const Hit *nearest) {
    Hit hit = *nearest;
    LeafRay leaf = leaf_ray(&rays->leaves, ray, lane);
    SlabRay slabs = slab_ray(&rays->slabs, ray, lane);
    uint order = octant(&slabs);
    Group waiting[STACK_SIZE];
    Group nodes = {0, 0x80000000}, primitives;   // the root
    int top = 0;
    for (;;) {
        uint highest = 31 - clz(nodes.bits);
        nodes.bits ^= 1u << highest;
        if (nodes.bits > 0x00ffffff) waiting[top++] = nodes;
        uint slot = (highest - 24) ^ order;
        uint node = nodes.first + popcount(nodes.bits & ((1u << slot) - 1));
        VISIT(nodes, node);
        enter_node(&slabs, RECORD(scene->nodes, node), order, hit.t, &nodes, &primitives);
#if INSTANCES
        if (in_world(&leaf) && primitives.bits) {
            if (nodes.bits > 0x00ffffff) waiting[top++] = nodes;
            waiting[top++] = primitives;
            nodes.bits = primitives.bits = 0;
        }
#endif
        for (; primitives.bits; primitives.bits &= primitives.bits - 1) {
            hit_primitive(scene, &leaf, primitives.first + first_bit(primitives.bits), stop_at_first, &hit);
            if (stop_at_first && hit.primitive >= 0) return hit;
        }
        if (nodes.bits <= 0x00ffffff) {
            if (top == 0) return hit;
            nodes = waiting[--top];
        }
#if INSTANCES
        while (nodes.bits <= 0x00ffffff) {   // instances: the first is entered, unless all have been visited
            if (nodes.bits) {
                int place = nodes.first + first_bit(nodes.bits);
                nodes.bits &= nodes.bits - 1;
                waiting[top++] = nodes;
                nodes = (Group){enter_instance(scene, ray, place, &leaf, &slabs), 0x80000000};
            } else {
                leaf = leaf_ray(&rays->leaves, ray, lane);
                slabs = slab_ray(&rays->slabs, ray, lane);
                if (top == 0) return hit;
                nodes = waiting[--top];
            }
            order = octant(&slabs);
        }
#endif
    }
}
