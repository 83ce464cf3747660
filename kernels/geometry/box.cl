// Ray against boxes by slabs (Nadolny 2.1–2.6), made safe against rounding and zeros.
//
// A plane's t is (plane − origin)·(1/direction): three roundings, so a relative error below 3 units. Near planes are
// pulled in and far planes pushed out by twice that (Ize 2013, "Robust BVH Ray Traversal", JCGT 2(2)), which costs
// nothing as it is folded into 1/direction. A zero component gives ±inf, clamped to the largest float, so that no
// 0·inf arises on a slab plane. Flat boxes are kept since near == far counts as a hit.
#include "geometry/wide.cl"

#define SLAB_PAD (6.0f * 5.9604645e-8f)
#define LARGEST 3.402823466e38f

typedef struct {
    float origin[3], near[3], far[3];   // near, far: padded 1/direction
    int backward[3];                    // 1 where the ray runs towards the box's low side
} SlabRay;

static inline SlabRay slab_ray(const Ray *ray) {
    SlabRay r;
#define INVERT(axis) { \
        float inverse = clamp(1.0f / ray->direction[axis], -LARGEST, LARGEST); \
        r.origin[axis] = ray->origin[axis]; \
        r.near[axis] = inverse * (1.0f - SLAB_PAD); \
        r.far[axis] = clamp(inverse * (1.0f + SLAB_PAD), -LARGEST, LARGEST); \
        r.backward[axis] = inverse < 0.0f; \
    }
    INVERT(0)
    INVERT(1)
    INVERT(2)
    return r;
}
