// What a ray meets where every surface stops it; from_camera plays no part then.
#include "surface.cl"
#include "sampler.cl"

// The surfaces that rays meet, whose closest hits are known; lanes that meet nothing get that of primitive 0.
static inline Hits first_surface_from(const Scene *scene, const Hits *closest, real3 origin, real3 direction,
                                      int from_camera, ireal active, Sampler *sampler, Surface *surface) {
#if PRIMITIVES
    *surface = surface_at(scene, origin, direction, closest);
#endif
    return *closest;
}

static inline Hits first_surface(const Scene *scene, real3 origin, real3 direction, int from_camera, ireal active,
                                 Sampler *sampler, Surface *surface) {
    Hits closest = closest_hit(scene, origin, direction, (real)(INFINITY), active);
    return first_surface_from(scene, &closest, origin, direction, from_camera, active, sampler, surface);
}

// What part of the light comes through to `origin` from a target, or from infinitely far along wi.
static inline real transmittance(const Scene *scene, real3 origin, real3 target, real3 wi, ireal infinite, ireal active) {
    real3 direction = choose(infinite, wi, sub(target, origin));
    ireal blocked = any_hit(scene, origin, direction, infinite ? (real)(INFINITY) : ONE, active);
    return (active & !blocked) ? ONE : ZERO;
}
