// Ray queries over arrays: one work-item answers LANES rays. World frame; t counts lengths of the direction.
//
// `unit` is the power of two by which the tree's lengths were multiplied (clrt/scene/scaling.py).
#include "traverse/trace.cl"

#define ROW3(array, row) vector(GATHER(real, array, 3 * row, ), GATHER(real, array, 3 * row + 1, ), \
                                GATHER(real, array, 3 * row + 2, ))

// The rays of a work-item's lanes, and which of them can hit anything.
typedef struct {
    real3 origin, direction;
    real t_max;
    ireal valid;
} QueryRays;

static inline QueryRays load_rays(global const float *origins, global const float *directions,
                                  global const float *t_max, float unit, uint first, uint count) {
    ureal ray = (ureal)(first) + LANE_INDEX;
    ireal inside = ray < count;
    ireal row = inside ? AS_INT(ray) : (ireal)((int)first);
    QueryRays r;
    r.origin = scale(ROW3(origins, row), unit);
    r.direction = ROW3(directions, row);
    r.t_max = GATHER(real, t_max, row, ) * unit;
    r.valid = inside & (r.t_max > 0.0f);
    return r;
}

static inline void store_hits(global RayHit *hits, float unit, uint first, uint count, const Hits *found) {
    for (uint lane = 0; lane < LANES && first + lane < count; ++lane) {
        int primitive = LANE_INT(found->primitive, lane);
        bool missed = primitive < 0;
        hits[first + lane] = (RayHit){missed ? INFINITY : LANE(found->t, lane) / unit, primitive,
                                      missed ? 0.0f : LANE(found->u, lane), missed ? 0.0f : LANE(found->v, lane)};
    }
}

#if NEXT_HIT
// The hits behind those in `hits`, in their place.
__attribute__((vec_type_hint(real)))
kernel void query_next_hit(SCENE_PARAMETERS, global const float *origins, global const float *directions,
                           global const float *t_max, global RayHit *hits, float unit, uint count) {
    Scene scene = SCENE_ARGUMENTS;
    uint first = (uint)get_global_id(0) * LANES;
    if (first >= count) return;
    QueryRays rays = load_rays(origins, directions, t_max, unit, first, count);
    ureal ray = (ureal)(first) + LANE_INDEX;
    ireal row = ray < count ? AS_INT(ray) : (ireal)((int)first);
    Hits after = {GATHER(real, hits, row, .t) * unit, ZERO, ZERO, GATHER(ireal, hits, row, .primitive)};
    Hits found = closest_hit(&scene, rays.origin, rays.direction, rays.t_max, rays.valid, &after);
    store_hits(hits, unit, first, count, &found);
}
#else
__attribute__((vec_type_hint(real)))
kernel void query_closest_hit(SCENE_PARAMETERS, global const float *origins, global const float *directions,
                              global const float *t_max, global RayHit *hits, float unit, uint count) {
    Scene scene = SCENE_ARGUMENTS;
    uint first = (uint)get_global_id(0) * LANES;
    if (first >= count) return;
    QueryRays rays = load_rays(origins, directions, t_max, unit, first, count);
    Hits found = closest_hit(&scene, rays.origin, rays.direction, rays.t_max, rays.valid);
    store_hits(hits, unit, first, count, &found);
}

__attribute__((vec_type_hint(real)))
kernel void query_any_hit(SCENE_PARAMETERS, global const float *origins, global const float *directions,
                          global const float *t_max, global uchar *blocked, float unit, uint count) {
    Scene scene = SCENE_ARGUMENTS;
    uint first = (uint)get_global_id(0) * LANES;
    if (first >= count) return;
    QueryRays rays = load_rays(origins, directions, t_max, unit, first, count);
    ireal found = any_hit(&scene, rays.origin, rays.direction, rays.t_max, rays.valid);
    for (uint lane = 0; lane < LANES && first + lane < count; ++lane) blocked[first + lane] = LANE_INT(found, lane) != 0;
}
#endif
