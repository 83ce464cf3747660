// No tree: a scene of few triangles, WIDTH at a time. Where eight would be met in a leaf after its box, this needs no
// guess of what comes next, which costs a processor more than the triangles.
#include "traverse/leaf.cl"

typedef LeafRays TreeRays;
static inline TreeRays tree_rays(real3 origin, real3 direction) { return leaf_rays(origin, direction); }

#if TRIANGLES
// Seldom called, unless hits behind others are asked for.
__attribute__((noinline)) static void meet_packs_exactly(const LeafRay *leaf, global const Triangles *packs, int count,
                                                         const bool stop_at_first, Hit *hit) {
    for (int i = 0; i < count && !(stop_at_first && hit->primitive >= 0); ++i)
        hit_triangles(leaf, pack_at(packs, i), stop_at_first, hit);
}
#endif

__attribute__((always_inline))
static inline Hit traverse(const Scene *scene, const TreeRays *rays, const Ray *ray, int lane, const bool stop_at_first,
                           const Hit *nearest) {
    Hit hit = *nearest;
    LeafRay leaf = leaf_ray(rays, ray, lane);
#if TRIANGLES
    int packs = (scene->counts.triangles + WIDTH - 1) / WIDTH;
    for (int i = 0; i < packs; ++i) VISIT(tests);
#if NEXT_HIT
    meet_packs_exactly(&leaf, RECORD(scene->packs, 0), packs, stop_at_first, &hit);
#else
    if (!meet_packs(&leaf.triangle_ray, RECORD(scene->packs, 0), packs, stop_at_first, &hit))
        meet_packs_exactly(&leaf, RECORD(scene->packs, 0), packs, stop_at_first, &hit);
#endif
#endif
#if LEAF_SPHERES
    for (int i = 0; i < scene->counts.spheres && !(stop_at_first && hit.primitive >= 0); ++i)
        hit_spheres(&leaf, RECORD(scene->leaf_spheres, i), 1, &hit);
#endif
    return hit;
}
