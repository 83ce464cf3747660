// Visibility with surfaces that light passes straight through: alpha masks, partial opacity, and single-sided surfaces.
//
// Such a surface stops a ray with the probability of its opacity, and attenuates a shadow ray by it. The ray keeps its
// origin, and the next surface follows in the order of hits (next_hit): each counts once, however many there are, also
// if they touch or coincide. A ray that leaves one of several coincident surfaces starts beyond all of them. Surfaces
// that are marked as opaque stop rays without being evaluated, and a shadow ray ends at any of them.
#include "surface/opacity.cl"
#include "bsdf/dispatch.cl"
#include "sampler/interface.cl"

// The first surfaces that stop rays whose closest hits are known. from_camera: see opacity_at.
static inline Hits first_surface_from(const Scene *scene, const Hits *closest, real3 origin, real3 direction,
                                      int from_camera, ireal active, Sampler *sampler) {
    real u = next_1d(sampler), left = ONE;
    Hits hits = *closest;
    ireal passes = active;
#if RASTER
    // A rasterised t differs from the traced one by rounding; the order of hits uses traced ones.
    ireal retraced = active & may_pass(scene, &hits, from_camera);
    if (ANY(retraced)) {
        Surface surface = surface_at(scene, origin, direction, &hits);
        retraced = retraced & (opacity_at(scene, &surface, direction, from_camera) < 1.0f);
        Hits traced = closest_hit(scene, origin, direction, (real)(INFINITY), retraced);
        hits = choose_hits(retraced, &traced, &hits);
    }
#endif
    for (;;) {
        passes = passes & may_pass(scene, &hits, from_camera);
        if (!ANY(passes)) return hits;
        Surface surface = surface_at(scene, origin, direction, &hits);
        left *= 1.0f - opacity_at(scene, &surface, direction, from_camera);
        passes = passes & (u < left);
        if (!ANY(passes)) return hits;
        Hits next = next_hit(scene, origin, direction, (real)(INFINITY), passes, &hits, SEARCH_CLOSEST);
        hits = choose_hits(passes, &next, &hits);
    }
}

// The transmittance to `origin` from the target on a light, or from infinity along wi. The ray ends where it hits that
// light.
static inline real transmittance(const Scene *scene, real3 origin, ireal light, real3 target, real3 wi, ireal infinite,
                                 ireal active) {
    real3 direction = choose(infinite, wi, sub(target, origin));
    real left = active ? ONE : ZERO, t_max = infinite ? (real)(INFINITY) : ONE;
    Hits hits = NO_HIT;
    ireal passes = active;
    for (;;) {
        hits = next_hit(scene, origin, direction, t_max, passes, &hits, SEARCH_OPAQUE);
        ireal hit = passes & (hits.primitive >= 0);
        passes = hit & may_pass(scene, &hits, false);
        left = (hit & !passes) ? ZERO : left;
        if (!ANY(passes)) return left;
        Surface surface = surface_at(scene, origin, direction, &hits);
        passes = passes & (surface.light != light);
        left = passes ? left * (1.0f - opacity_at(scene, &surface, direction, false)) : left;
        passes = passes & (left > 0.0f);
    }
}
