// Spheres of a scene that has few: the rays of all lanes are tested against each sphere before each traverses the BVH
// alone. A test costs less per ray than a BVH node.
#include "core/vector.cl"
#include SPHERE_TEST

SPHERE_OF(real, ireal, TwiceReal, lone)

// Whether a hit at t > 0 comes after the last one, if NEXT_HIT.
static inline ireal is_ahead(real t, int primitive, const Hits *after) {
#if NEXT_HIT
    ireal later = (after->instance < 0) | ((after->instance == 0) & (after->primitive < primitive));
    return (t > 0.0f) & ((t > after->t) | ((t == after->t) & later));
#else
    return t > 0.0f;
#endif
}

// The closest sphere hits of enabled lanes nearer than t_max (see next_hit); on a miss t_max and no primitive.
static inline Hits intersect_lone_spheres(const Scene *scene, real3 origin, real3 direction, real t_max, ireal enabled,
                                          const Hits *after) {
    Hits hits = {t_max, ZERO, ZERO, (ireal)(-1), (ireal)(0)};
    const real o[3] = {origin.x, origin.y, origin.z}, d[3] = {direction.x, direction.y, direction.z};
    for (int i = 0; i < scene->counts.spheres; ++i) {
        global const LeafSphere *sphere = RECORD(scene->leaf_spheres, i);
        const real f[3] = {o[0] - sphere->center[0], o[1] - sphere->center[1], o[2] - sphere->center[2]};
        ireal hit = enabled ? lone_may_hit(f, d, sphere->radius) : NO_LANES;   // inactive lanes hold no rays
        if (!ANY(hit)) continue;
        real near, far;
        lone_roots(o, d, sphere->center, sphere->radius, &near, &far);
        real t = is_ahead(near, sphere->primitive, after) ? near : far;
        hit = hit ? is_ahead(t, sphere->primitive, after) & (t < hits.t) : NO_LANES;   // at equal t the first stays
        hits.t = hit ? t : hits.t;
        hits.primitive = hit ? (ireal)(sphere->primitive) : hits.primitive;
    }
    return hits;
}
