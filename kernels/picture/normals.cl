// The shading normal on the camera's side, unit before it is averaged over the pixel. World frame.
#include "surface.cl"

static inline real2 picture_place(Sampler *sampler) { return next_2d(sampler); }

static inline real3 picture_value(const Scene *scene, const Launch *launch, real3 direction, real t,
                                  const Surface *surface) {
    return surface->ns;
}
