// Brute force (no BVH): every primitive is tested. The reference for BVHs.
#include "traverse/leaf.cl"

typedef LeafRays TreeRays;
static inline TreeRays tree_rays(const Scene *scene, real3 origin, real3 direction, real t_max) {
    return leaf_rays(origin, direction);
}

static inline Hit traverse(const Scene *scene, const TreeRays *rays, const Ray *ray, int lane, const int search,
                           const Hit *nearest) {
    const bool stop_at_first = search == SEARCH_ANY;
    Hit hit = *nearest;
    LeafRay leaf = leaf_ray(rays, ray, lane);
#if TRIANGLES
    for (int i = 0; i < scene->counts.triangles && !(stop_at_first && hit.primitive >= 0); ++i) {
        VISIT(tests, i);
        hit_triangles(&leaf, RECORD(scene->leaf_triangles, i), stop_at_first, &hit);
    }
#endif
#if LEAF_SPHERES
    for (int i = 0; i < scene->counts.spheres && !(stop_at_first && hit.primitive >= 0); ++i)
        hit_spheres(&leaf, RECORD(scene->leaf_spheres, i), 1, &hit);
#endif
    return hit;
}
