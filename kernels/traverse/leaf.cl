// Leaf intersection, and where the search for a hit ends: all that BVH traversal uses of primitives.
//
// Of several hits at the same t the lowest primitive wins (of the lowest instance), so the result does not depend on
// the BVH. `search` and `stop_at_first` are compile-time constants at every call, see traverse/trace.cl.
#include "geometry/wide.cl"
#include "traverse/visits.cl"
#include TRIANGLE_TEST
#include SPHERE_TEST

// With triangles alone, only the triangle test's form of the ray is needed.
#define WHOLE_RAY (LEAF_SPHERES || NEXT_HIT || INSTANCES)

typedef struct {
#if WHOLE_RAY
    Ray ray;
#endif
#if TRIANGLES
    TriangleRay triangle_ray;
#endif
} LeafRay;

#if TRIANGLES
typedef TriangleRays LeafRays;
static inline LeafRays leaf_rays(real3 origin, real3 direction) { return triangle_rays(origin, direction); }
#else
typedef int LeafRays;   // the sphere test needs only the ray
static inline LeafRays leaf_rays(real3 origin, real3 direction) { return 0; }
#endif

static inline LeafRay leaf_ray(const LeafRays *rays, const Ray *ray, int lane) {
    LeafRay r;
#if WHOLE_RAY
    r.ray = *ray;
#endif
#if TRIANGLES
    r.triangle_ray = triangle_ray(rays, ray, lane);
#endif
    return r;
}

static inline bool comes_before(int instance, int primitive, int other_instance, int other_primitive) {
    return instance < other_instance || (instance == other_instance && primitive < other_primitive);
}

#if INSTANCES
#define HIT(ray, t, u, v, primitive) ((Hit){t, u, v, primitive, (ray)->ray.instance})
#define INSTANCE_OF(hit) ((hit)->instance)
#define RAYS_INSTANCE(ray) ((ray)->ray.instance)
#define AFTER_INSTANCE(ray) ((ray)->ray.after_instance)
#else
#define HIT(ray, t, u, v, primitive) ((Hit){t, u, v, primitive})
#define RAYS_INSTANCE(ray) 0
#define INSTANCE_OF(hit) 0
#define AFTER_INSTANCE(ray) 0
#endif

static inline void keep_closest(const LeafRay *ray, Hit *hit, float t, float u, float v, int primitive) {
#if NEXT_HIT
    if (t < ray->ray.after_t || (t == ray->ray.after_t && !comes_before(AFTER_INSTANCE(ray), ray->ray.after_primitive,
                                                                       RAYS_INSTANCE(ray), primitive))) return;
#endif
    if (t < hit->t || (t == hit->t && comes_before(RAYS_INSTANCE(ray), primitive, INSTANCE_OF(hit), hit->primitive)))
        *hit = HIT(ray, t, u, v, primitive);
}

// Whether the search ends with the closest hit so far, after a leaf was intersected.
static inline bool ends_search(const Scene *scene, const int search, const Hit *hit) {
#if OPACITY
    if (search == SEARCH_OPAQUE && hit->primitive >= 0) {
        int first = 0;
#if INSTANCES
        first = RECORD(scene->placements, hit->instance)->first;
#endif
        return RECORD(scene->opaque, first + hit->primitive)->rays > 0;
    }
#endif
    return search == SEARCH_ANY && hit->primitive >= 0;
}

#if TRIANGLES
static inline void hit_triangles(const LeafRay *ray, global const Triangles *leaf, const bool stop_at_first, Hit *hit) {
    WideHit found = intersect_triangles(&ray->triangle_ray, leaf, hit->t);
    if (!WIDE_ANY(found.hit)) return;
#if WIDTH == 1
    keep_closest(ray, hit, found.t, found.u, found.v, leaf->primitive);
#else
    if (stop_at_first) {
        if (WIDE_ANY(found.hit & (found.t < hit->t))) hit->primitive = 0;
        return;
    }
    const float *t = (const float *)&found.t, *u = (const float *)&found.u, *v = (const float *)&found.v;
    for (uint inside = wide_bits(found.hit); inside; inside &= inside - 1) {
        int i = first_bit(inside);
        keep_closest(ray, hit, t[i], u[i], v[i], leaf->primitive[i]);
    }
#endif
}
#endif

#if LEAF_SPHERES
SPHERE_OF(float, int, Twice, sphere)

// Find the nearest root in (t_min, t_max], if there is one.
static inline bool intersect_sphere(const Ray *ray, global const LeafSphere *sphere, float t_min, float t_max, float *t) {
    const float f[3] = {ray->origin[0] - sphere->center[0], ray->origin[1] - sphere->center[1],
                        ray->origin[2] - sphere->center[2]};
    if (!sphere_may_hit(f, ray->direction, sphere->radius)) return false;
    float near, far;
    sphere_roots(ray->origin, ray->direction, sphere->center, sphere->radius, &near, &far);
    *t = near > t_min ? near : far;
    return *t > t_min && *t <= t_max;
}

static inline void hit_spheres(const LeafRay *ray, global const LeafSphere *spheres, int count, Hit *hit) {
    for (int i = 0; i < count; ++i) {
        float t = 0.0f;
#if NEXT_HIT
        while (intersect_sphere(&ray->ray, spheres + i, t, hit->t, &t))   // the entry and the exit point
#else
        if (intersect_sphere(&ray->ray, spheres + i, t, hit->t, &t))
#endif
            keep_closest(ray, hit, t, 0.0f, 0.0f, spheres[i].primitive);
    }
}
#endif
