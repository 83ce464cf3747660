// Depth at the pixel centre, along the viewing direction, in scene units; for a 360° camera the distance. Not averaged
// over the pixel, since the mean of a near and a far depth is meaningless.
#include "integrator/camera_rays.cl"
#include "surface/surface.cl"

static inline real3 picture_value(const Scene *scene, const Launch *launch, real3 direction, real t,
                                  Surface *surface) {
#if ALL_AROUND
    real depth = t;
#else
    real depth = t * dot3(direction, viewing_direction(scene, launch));
#endif
    return splat(depth * (1.0f / SCENE_UNIT));
}
