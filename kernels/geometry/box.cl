// Ray–box intersection by slabs (Nadolny 2.1–2.6), one multiplication per plane.
//
// A plane's t is (plane − origin)·(1/direction). Near planes are pulled in and far planes pushed out by the relative
// SLAB_PAD, at no cost since it is folded into 1/direction. A zero component gives ±inf, and on a slab plane 0·inf =
// NaN, which every comparison here drops: such a ray counts as inside the slab. Flat boxes are hit since near == far
// counts as a hit.
#include "geometry/wide.cl"
#include "core/vector.cl"
#include BOX_TEST

// Boxes that end before this t are skipped: with NEXT_HIT, the t of the last hit.
#if NEXT_HIT
#define FIRST_T(ray) ((ray)->after_t)
#else
#define FIRST_T(ray) 0.0f
#endif

typedef struct {
    float origin[3], near[3], far[3];   // near, far: padded 1/direction
    int backward[3];                    // whether the ray runs towards the box's low side
#if NEXT_HIT
    float after_t;
#endif
} SlabRay;

typedef struct { real near[3], far[3]; ireal backward[3]; } SlabRays;   // the same for all lanes, set up together

static inline SlabRays slab_rays(real3 direction) {
    SlabRays r;
#define INVERT(axis, d) { \
        real inverse = 1.0f / d; \
        r.near[axis] = inverse * (1.0f - SLAB_PAD); \
        r.far[axis] = inverse * (1.0f + SLAB_PAD); \
        r.backward[axis] = inverse < 0.0f; \
    }
    INVERT(0, direction.x)
    INVERT(1, direction.y)
    INVERT(2, direction.z)
    return r;
}

static inline SlabRay slab_ray(const SlabRays *rays, const Ray *ray, int lane) {
    return (SlabRay){{ray->origin[0], ray->origin[1], ray->origin[2]},
                     {LANE(rays->near[0], lane), LANE(rays->near[1], lane), LANE(rays->near[2], lane)},
                     {LANE(rays->far[0], lane), LANE(rays->far[1], lane), LANE(rays->far[2], lane)},
                     {LANE_INT(rays->backward[0], lane), LANE_INT(rays->backward[1], lane), LANE_INT(rays->backward[2], lane)},
#if NEXT_HIT
                     ray->after_t,
#endif
    };
}
