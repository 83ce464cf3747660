// What a ray meets where every surface stops it.
#include "surface.cl"
#include "sampler.cl"

// The surfaces that rays meet; lanes that meet nothing get that of primitive 0. The origin stays.
static inline Hits first_surface(const Scene *scene, real3 *origin, real3 direction, ireal active, Sampler *sampler,
                                 Surface *surface) {
    Hits hits = closest_hit(scene, *origin, direction, (real)(INFINITY), active);
#if PRIMITIVES
    *surface = surface_at(scene, *origin, direction, &hits);
#endif
    return hits;
}

// What part of the light comes through to `origin` from a target, or from infinitely far along wi.
static inline real transmittance(const Scene *scene, real3 origin, real3 target, real3 wi, ireal infinite, ireal active) {
    real3 direction = choose(infinite, wi, sub(target, origin));
    ireal blocked = any_hit(scene, origin, direction, infinite ? (real)(INFINITY) : ONE, active);
    return (active & !blocked) ? ONE : ZERO;
}
