// Brute force for scenes of few triangles, WIDTH at a time. If a BVH would only find a leaf of eight behind a box, this
// avoids branch mispredictions, which cost a CPU more than the triangle tests. Each pack has a box, which the rays of
// all lanes are tested against together.
#include "geometry/box.cl"
#include "traverse/leaf.cl"

typedef struct {
    LeafRays leaves;
    ireal chosen;   // bits of the packs whose boxes a ray hits: see is_chosen
} TreeRays;

#if TRIANGLES
static inline ireal hits_box(const SlabRays *rays, real3 origin, global const Triangles *pack, real t_max) {
    real t_near = ZERO, t_far = t_max;
#define PACK_SLABS(axis, o) { \
        real lo = pack->lo[axis] - o, hi = pack->hi[axis] - o; \
        real near = (rays->backward[axis] ? hi : lo) * rays->near[axis]; \
        real far = (rays->backward[axis] ? lo : hi) * rays->far[axis]; \
        t_near = near > t_near ? near : t_near; \
        t_far = far < t_far ? far : t_far; \
    }
    PACK_SLABS(0, origin.x)
    PACK_SLABS(1, origin.y)
    PACK_SLABS(2, origin.z)
    return t_near <= t_far;
}

static inline ireal choose_packs(const Scene *scene, real3 origin, real3 direction, real t_max) {
    int count = RECORD(scene->packs, 0)->count;
    if (count == 1) return (ireal)(1);
    SlabRays slabs = slab_rays(direction);
    ireal chosen = (ireal)(INT_MIN);   // the last bit
    for (int i = 0; i < count && i < LAST_BIT; ++i)
        chosen |= hits_box(&slabs, origin, RECORD(scene->packs, i), t_max) ? (ireal)(1 << i) : (ireal)(0);
    return chosen;
}

// Rarely called.
__attribute__((noinline)) static Hit intersect_packs_exactly(const LeafRay *leaf, ARRAY(Triangles) packs,
                                                             const bool stop_at_first, Hit hit) {
    for (int i = 0; i < RECORD(packs, 0)->count * HALVES && !(stop_at_first && hit.primitive >= 0); ++i)
        hit_triangles(leaf, pack_at(packs, i), stop_at_first, &hit);
    return hit;
}
#endif

static inline TreeRays tree_rays(const Scene *scene, real3 origin, real3 direction, real t_max) {
    TreeRays rays;
    rays.leaves = leaf_rays(origin, direction);
#if TRIANGLES
    rays.chosen = choose_packs(scene, origin, direction, t_max);
#endif
    return rays;
}

__attribute__((always_inline))
static inline Hit traverse(const Scene *scene, const TreeRays *rays, const Ray *ray, int lane, const int search,
                           const Hit *nearest) {
    const bool stop_at_first = search == SEARCH_ANY;
    Hit hit = *nearest;
    LeafRay leaf = leaf_ray(&rays->leaves, ray, lane);
#if TRIANGLES
    uint chosen = (uint)LANE_INT(rays->chosen, lane);
    for (int i = 0; i < RECORD(scene->packs, 0)->count; ++i) if (is_chosen(chosen, i)) VISIT(tests, i);
    if (!intersect_packs(&leaf.triangle_ray, ray, scene->packs, chosen, stop_at_first, &hit))
        hit = intersect_packs_exactly(&leaf, scene->packs, stop_at_first, *nearest);
#endif
#if LEAF_SPHERES
    for (int i = 0; i < scene->counts.spheres && !(stop_at_first && hit.primitive >= 0); ++i)
        hit_spheres(&leaf, RECORD(scene->leaf_spheres, i), 1, &hit);
#endif
    return hit;
}
