// Visibility with opaque surfaces only; from_camera is ignored.
#include "surface/surface.cl"
#include "sampler/interface.cl"

static inline Hits first_surface_from(const Scene *scene, const Hits *closest, real3 origin, real3 direction,
                                      int from_camera, ireal active, Sampler *sampler) {
    return *closest;
}

// The transmittance to `origin` from the target on a light, or from infinity along wi.
static inline real transmittance(const Scene *scene, real3 origin, ireal light, real3 target, real3 wi, ireal infinite,
                                 ireal active) {
    real3 direction = choose(infinite, wi, sub(target, origin));
    ireal blocked = any_hit(scene, origin, direction, infinite ? (real)(INFINITY) : ONE, active);
    return (active & !blocked) ? ONE : ZERO;
}
