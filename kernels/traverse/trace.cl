// Ray tracing of all lanes: closest_hit and any_hit, with the BVH layout that the host chose.
//
// A scene without primitives has no BVH: every ray escapes, and none of this is compiled.
#include "core/vector.cl"

typedef struct { real t, u, v; ireal primitive, instance; } Hits;   // primitive < 0: miss

static inline Hits choose_hits(ireal mask, const Hits *a, const Hits *b) {
    return (Hits){mask ? a->t : b->t, mask ? a->u : b->u, mask ? a->v : b->v, mask ? a->primitive : b->primitive,
                  mask ? a->instance : b->instance};
}

// Where a search ends: at the closest hit, at the first one found (`stop_at_first`), or there if the closest hit so far is
// on a primitive that is opaque to all rays.
#define SEARCH_CLOSEST 0
#define SEARCH_ANY 1
#define SEARCH_OPAQUE 2

#include TREE
#include LONE_SPHERES_FILE

#if IN_TREE
static inline Ray one_ray(const real3 *origin, const real3 *direction, const real *t_max, int lane) {
    Ray ray;
    ray.origin[0] = LANE(origin->x, lane);
    ray.origin[1] = LANE(origin->y, lane);
    ray.origin[2] = LANE(origin->z, lane);
    ray.direction[0] = LANE(direction->x, lane);
    ray.direction[1] = LANE(direction->y, lane);
    ray.direction[2] = LANE(direction->z, lane);
    ray.t_max = LANE(*t_max, lane);
#if NEXT_HIT
    ray.after_t = 0.0f;
    ray.after_primitive = -1;
#if INSTANCES
    ray.after_instance = -1;
#endif
#endif
#if INSTANCES
    ray.instance = IN_WORLD;
#endif
    return ray;
}
#endif

// Whether a ray is finite with a nonzero direction: NaN would enter every box, also those of empty slots, and overflow
// the stack. Other rays hit nothing.
static inline ireal is_ray(real3 origin, real3 direction) {
    real sum = origin.x + origin.y + origin.z + (direction.x + direction.y + direction.z);
    return (absolute(sum) <= 3.4e38f) & (largest(absolute3(direction)) > 0.0f);
}

// The closest hit of each active lane's ray with 0 < t < t_max; if NEXT_HIT the first one after `after`, in the order
// of (t, instance, primitive). search: where it may end, see above.
static inline Hits next_hit(const Scene *scene, real3 origin, real3 direction, real t_max, ireal active,
                            const Hits *after, const int search) {
    Hits hits = {(real)(INFINITY), ZERO, ZERO, (ireal)(-1), (ireal)(0)};
#if PRIMITIVES
    ireal enabled = active & is_ray(origin, direction);
#if LONE_SPHERES
    hits = intersect_lone_spheres(scene, origin, direction, t_max, enabled, after);
#else
    hits.t = t_max;
#endif
#if IN_TREE
    RealLanes t, u, v;
    IntLanes primitive, instance;
    t.all = hits.t;
    u.all = v.all = ZERO;
    primitive.all = hits.primitive;
    instance.all = (ireal)(0);
    TreeRays rays = tree_rays(scene, origin, direction, hits.t);
    for (int lane = 0; lane < LANES; ++lane) {
        if (!LANE_INT(enabled, lane)) continue;
        Ray ray = one_ray(&origin, &direction, &t_max, lane);
#if MOTION
        ray.time = LANE(scene->time, lane);
#endif
#if NEXT_HIT
        ray.after_t = LANE(after->t, lane);
        ray.after_primitive = LANE_INT(after->primitive, lane);
#if INSTANCES
        ray.after_instance = LANE_INT(after->instance, lane);
#endif
#endif
        VISIT(closest, 0);
        const Hit nearest = {t.lane[lane], 0.0f, 0.0f, primitive.lane[lane]};
        Hit hit = traverse(scene, &rays, &ray, lane, search, &nearest);
        t.lane[lane] = hit.t;
        u.lane[lane] = hit.u;
        v.lane[lane] = hit.v;
        primitive.lane[lane] = hit.primitive;
        instance.lane[lane] = INSTANCE_OF(&hit);
    }
    hits = (Hits){t.all, u.all, v.all, primitive.all, instance.all};
#endif
#endif
    return hits;
}

#define NO_HIT {ZERO, ZERO, ZERO, (ireal)(-1), (ireal)(-1)}   // precedes every hit

static inline Hits closest_hit(const Scene *scene, real3 origin, real3 direction, real t_max, ireal active) {
    const Hits none = NO_HIT;
    return next_hit(scene, origin, direction, t_max, active, &none, SEARCH_CLOSEST);
}

// Return the active lanes whose rays hit anything with 0 < t < t_max.
static inline ireal any_hit(const Scene *scene, real3 origin, real3 direction, real t_max, ireal active) {
    ireal blocked = NO_LANES;
#if PRIMITIVES
    ireal enabled = active & is_ray(origin, direction);
#if LONE_SPHERES
    const Hits none = NO_HIT;
    blocked = intersect_lone_spheres(scene, origin, direction, t_max, enabled, &none).primitive >= 0;
    enabled = enabled & !blocked;
#endif
#if IN_TREE
    TreeRays rays = tree_rays(scene, origin, direction, t_max);
    IntLanes found;
    found.all = (ireal)(-1);
    for (int lane = 0; lane < LANES; ++lane) {
        if (!LANE_INT(enabled, lane)) continue;
        Ray ray = one_ray(&origin, &direction, &t_max, lane);
#if MOTION
        ray.time = LANE(scene->time, lane);
#endif
        VISIT(blocked, 0);
        const Hit none = {ray.t_max, 0.0f, 0.0f, -1};
        found.lane[lane] = traverse(scene, &rays, &ray, lane, SEARCH_ANY, &none).primitive;
    }
    blocked = blocked | (found.all >= 0);
#endif
#endif
    return blocked;
}
