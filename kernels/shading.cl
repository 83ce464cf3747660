// What the material of a surface is where a ray met it, in the frame of its shading normal. World frame but for wo.
#include "bsdf.cl"

#if COAT_NORMALS
#define FRAME_NORMAL(surface) frame_normal(surface)
#else
#define FRAME_NORMAL(surface) (surface)->ns
#endif

#if PRIMITIVES
typedef struct {
    Frame frame;
    real3 wo;        // local
    Bsdf bsdf;
} Shading;

// Turns the surface to the side that a ray along `direction` comes from, with what its normal map says.
static inline Shading shading_at(const Scene *scene, real3 direction, Surface *surface) {
    Shading shading;
    real3 towards = negate(direction);
#if NORMAL_MAPS
    bend_normal(scene, surface);
#endif
    turn_towards(surface, towards);
    shading.frame = frame_around(FRAME_NORMAL(surface));
    shading.wo = to_local(shading.frame, towards);
    bsdf_at(scene, surface, &shading.bsdf);
    return shading;
}
#endif
