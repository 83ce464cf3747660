// The shading normal on the camera's side, normalised before it is averaged over the pixel. World frame.
#include "bsdf/dispatch.cl"

static inline real3 picture_value(const Scene *scene, const Launch *launch, real3 direction, real t,
                                  Surface *surface) {
#if NORMAL_MAPS
    bend_normal(scene, surface);
#endif
    turn_towards(surface, negate(direction));
    return surface->ns;
}
