// Rays of a query as received from the host, LANES at a time, and their results. World frame; t is in multiples of
// the direction's length.
//
// `unit` is the power of two by which the lengths in the BVH were scaled (clrt/scene/geometry/scaling.py). Directions
// are scaled to a length near 1 by a power of two as well, so that neither affects precision: t in the host's units is
// t·to_t.
#include "core/loop_limit.cl"
#include "traverse/trace.cl"

#define QUERY_RAYS global const float *origins, global const float *directions, global const float *t_max
#define ROW3(array, row) vector(GATHER(real, array, 3 * row, ), GATHER(real, array, 3 * row + 1, ), \
                                GATHER(real, array, 3 * row + 2, ))

typedef struct {
    real3 origin, direction;
    real t_max, to_t;
    ireal row, valid;    // index of the ray in the host's arrays, and whether it can hit anything
} Rays;

// Load rays `first`, first + 1 … into the lanes; those at and after `end` are invalid.
static inline Rays load_rays(QUERY_RAYS, float unit, uint first, uint end) {
    ureal ray = (ureal)(first) + LANE_INDEX;
    ireal inside = ray < end;
    Rays r;
    r.row = inside ? AS_INT(ray) : (ireal)((int)first);
    r.direction = ROW3(directions, r.row);
    real power = AS_REAL(AS_INT(largest(absolute3(r.direction))) & 0x7f800000);
    power = power > 0.0f ? power : (real)(1.17549435e-38f);
    r.direction = scale(r.direction, 1.0f / power);
    r.origin = scale(ROW3(origins, r.row), unit);
    r.to_t = power * unit;
    r.t_max = GATHER(real, t_max, r.row, ) * r.to_t;
    r.valid = inside & (r.t_max > 0.0f) & is_ray(r.origin, r.direction);
    return r;
}

// Convert a hit to the record returned to the host; primitive < 0: miss.
static inline RayHit ray_hit(float t, float u, float v, int primitive, int instance, float to_t) {
    RayHit hit = {INFINITY, -1, 0.0f, 0.0f};
#if INSTANCES
    hit.instance = primitive < 0 ? -1 : instance;
#endif
    if (primitive < 0) return hit;
    hit.t = t / to_t;
    hit.primitive = primitive;
    hit.u = u;
    hit.v = v;
    return hit;
}
