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
//
// Registers limit how many rays a GPU has in flight. So far planes use the 1/direction of the near ones, and the least
// of their t is pushed out instead; and the axes are written out, since some compilers (LLVM's for NVIDIA) do not
// unroll a loop over them and then keep in memory what it indexes.
#include "traverse/slab_rays.cl"
#include UPPER_LEVEL

// From (1 − SLAB_PAD)/direction to (1 + SLAB_PAD)/direction, with the roundings of both.
#define FAR_PAD (1.0f + 3.0f * SLAB_PAD)

typedef struct { float step, near, far; } Planes;   // of one axis: the step, and p − origin for near and far planes
typedef struct { float4 near, far; } Spans;         // the t at which a ray enters and leaves four children
typedef struct { uint first, bits; } Group;

static inline Planes planes_of(const SlabRay *ray, int axis, uint p, uint exponent) {
    float base = as_float(p) - ray->origin[axis];
    float pad = (base < 0.0f ? -base : base) * (ray->backward[axis] ? -ORIGIN_PAD : ORIGIN_PAD);
    return (Planes){as_float((exponent & 0xff) << 23), base - pad, base + pad};
}

// Clip the spans of four children to the slabs of an axis, one byte each in low and in high.
static inline void clip(Spans *spans, const SlabRay *ray, int axis, const Planes *planes, uint low, uint high) {
    float4 near_side = convert_float4(as_uchar4(ray->backward[axis] ? high : low));
    float4 far_side = convert_float4(as_uchar4(ray->backward[axis] ? low : high));
    float4 near = (near_side * planes->step + planes->near) * ray->near[axis];
    float4 far = (far_side * planes->step + planes->far) * ray->near[axis];
    spans->near = fmax(near, spans->near);   // these drop NaN, as box.cl's comparisons do, and are one instruction on
    spans->far = fmin(far, spans->far);      // GPUs
}

// Return the bits of those of four children that are hit, one byte each in meta.
static inline uint entered(const Spans *spans, uint order, float t_max, uint meta) {
    // For nodes the low bits of meta are 24 + slot, permuted to the ray's order; for leaves they are below 24 and
    // unchanged.
    uint nodes = (meta & meta << 1 & 0x10101010) >> 4;
    uint4 place = convert_uint4(as_uchar4((meta ^ nodes * order) & 0x1f1f1f1f));
    uint4 hit = as_uint4(spans->near <= fmin(spans->far * FAR_PAD, t_max));
    uint4 bits = convert_uint4(as_uchar4(meta >> 5 & 0x07070707)) << place & hit;
    return bits.x | bits.y | bits.z | bits.w;
}

static inline void enter_node(const SlabRay *ray, global const Node *node, uint order, float t_max, Group *nodes,
                              Group *primitives) {
    global const uint4 *words = (global const uint4 *)node;
    uint4 frame = words[0], links = words[1], a = words[2], b = words[3], c = words[4];
    Planes x = planes_of(ray, 0, frame.x, frame.w), y = planes_of(ray, 1, frame.y, frame.w >> 8);
    Planes z = planes_of(ray, 2, frame.z, frame.w >> 16);
    Spans first = {FIRST_T(ray), INFINITY}, second = first;   // children 0 … 3 and 4 … 7
    clip(&first, ray, 0, &x, a.x, b.z);
    clip(&first, ray, 1, &y, a.z, c.x);
    clip(&first, ray, 2, &z, b.x, c.z);
    clip(&second, ray, 0, &x, a.y, b.w);
    clip(&second, ray, 1, &y, a.w, c.y);
    clip(&second, ray, 2, &z, b.y, c.w);
    uint bits = entered(&first, order, t_max, links.z) | entered(&second, order, t_max, links.w);
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

static inline Hit traverse(const Scene *scene, const TreeRays *rays, const Ray *ray, int lane, const int search,
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
            hit_primitive(scene, &leaf, primitives.first + first_bit(primitives.bits), search == SEARCH_ANY, &hit);
            if (ends_search(scene, search, &hit)) return hit;
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
