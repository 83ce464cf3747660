// Ray queries over arrays: each work-item answers LANES rays, one by one or, if the host selects it, as a packet.
#include "query/query_rays.cl"
#include PACKETS

#if PACKET_RAYS
#define CLOSEST_HIT closest_hit_coherent
#define ANY_HIT any_hit_coherent
#else
#define CLOSEST_HIT closest_hit
#define ANY_HIT any_hit
#endif

// The answers of a work-item whose loops the driver ended early are marked: primitive −2, blocked 2.

static inline void store_hits(global RayHit *hits, const Rays *rays, uint first, uint count, const Hits *found) {
    bool ended = loops_ended(first);
    for (uint lane = 0; lane < LANES && first + lane < count; ++lane) {
        hits[first + lane] = ray_hit(LANE(found->t, lane), LANE(found->u, lane), LANE(found->v, lane),
                                     LANE_INT(found->primitive, lane), LANE_INT(found->instance, lane), LANE(rays->to_t, lane));
        if (ended) hits[first + lane].primitive = -2;
    }
}

#if NEXT_HIT
// Replace each hit in `hits` by the next one along its ray.
__attribute__((vec_type_hint(real)))
kernel void query_next_hit(SCENE_PARAMETERS, QUERY_RAYS, global RayHit *hits, float unit, uint count) {
    Scene scene = SCENE_ARGUMENTS;
    uint first = (uint)get_global_id(0) * LANES;
    if (first >= count) return;
    Rays rays = load_rays(origins, directions, t_max, unit, first, count);
    Hits after = {GATHER(real, hits, rays.row, .t) * rays.to_t, ZERO, ZERO, GATHER(ireal, hits, rays.row, .primitive)};
#if INSTANCES
    after.instance = GATHER(ireal, hits, rays.row, .instance);
#endif
    Hits found = next_hit(&scene, rays.origin, rays.direction, rays.t_max, rays.valid, &after, SEARCH_CLOSEST);
    store_hits(hits, &rays, first, count, &found);
}
#else
__attribute__((vec_type_hint(real)))
kernel void query_closest_hit(SCENE_PARAMETERS, QUERY_RAYS, global RayHit *hits, float unit, uint count) {
    Scene scene = SCENE_ARGUMENTS;
    uint first = (uint)get_global_id(0) * LANES;
    if (first >= count) return;
    Rays rays = load_rays(origins, directions, t_max, unit, first, count);
    Hits found = CLOSEST_HIT(&scene, rays.origin, rays.direction, rays.t_max, rays.valid);
    store_hits(hits, &rays, first, count, &found);
}

__attribute__((vec_type_hint(real)))
kernel void query_any_hit(SCENE_PARAMETERS, QUERY_RAYS, global uchar *blocked, float unit, uint count) {
    Scene scene = SCENE_ARGUMENTS;
    uint first = (uint)get_global_id(0) * LANES;
    if (first >= count) return;
    Rays rays = load_rays(origins, directions, t_max, unit, first, count);
    ireal found = ANY_HIT(&scene, rays.origin, rays.direction, rays.t_max, rays.valid);
    bool ended = loops_ended(first);
    for (uint lane = 0; lane < LANES && first + lane < count; ++lane)
        blocked[first + lane] = ended ? 2 : LANE_INT(found, lane) != 0;
}
#endif
