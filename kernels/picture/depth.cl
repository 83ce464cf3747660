// How far ahead of the camera the pixel's middle is, measured along the view, in units of the scene; all around the camera
// it is the distance. Not averaged over the pixel: the mean of what is near and what is far is no place.
#include "surface.cl"

static inline real3 picture_value(const Scene *scene, const Launch *launch, real3 direction, real t,
                                  Surface *surface) {
#if ALL_AROUND
    real depth = t;
#else
    real depth = t * dot3(direction, normalize3(broadcast(launch->forward)));
#endif
    return splat(depth * (1.0f / SCENE_UNIT));
}
