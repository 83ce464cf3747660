// What a ray meets where some surfaces let light straight through: cut-outs, veils, and surfaces with one side.
//
// Such a surface stops a ray with the probability of its opacity; a shadow ray loses that part.
#include "opacity.cl"
#include "bsdf.cl"
#include "sampler.cl"

#define MOST_LAYERS 256   // that one ray may cross; what lies behind is not seen

// Where a ray goes on behind a surface that lets it through.
static inline real3 behind(const Surface *surface, real3 direction) {
    return offset_origin(surface->p, surface->p_error, surface->ng, direction);
}

// The first surfaces that stop rays, whose closest hits are known; lanes that meet none get any. The origin ends on the last
// surface that let its ray through, and `gone` is what the ray has gone from where it began to there.
static inline Hits first_stop_from(const Scene *scene, const Hits *closest, real3 *origin, real3 direction, ireal active,
                                   Sampler *sampler, Surface *surface, real *gone) {
    real u = next_1d(sampler);
    *gone = ZERO;
    Hits hits = *closest;
    for (int layer = 0; layer < MOST_LAYERS; ++layer) {
        *surface = surface_at(scene, *origin, direction, &hits);
        real opacity = opacity_at(scene, surface, direction);
        ireal passes = active & (hits.primitive >= 0) & (u >= opacity);
        if (!ANY(passes)) break;
        u = passes ? (u - opacity) / (1.0f - opacity) : u;     // as random as it was
        *gone = passes ? *gone + hits.t : *gone;
        *origin = choose(passes, behind(surface, direction), *origin);
        Hits next = closest_hit(scene, *origin, direction, (real)(INFINITY), passes);
        hits.t = passes ? next.t : hits.t;
        hits.u = passes ? next.u : hits.u;
        hits.v = passes ? next.v : hits.v;
        hits.primitive = passes ? next.primitive : hits.primitive;
        hits.instance = passes ? next.instance : hits.instance;
    }
    return hits;
}

static inline Hits first_stop(const Scene *scene, real3 *origin, real3 direction, ireal active, Sampler *sampler,
                              Surface *surface, real *gone) {
    Hits closest = closest_hit(scene, *origin, direction, (real)(INFINITY), active);
    return first_stop_from(scene, &closest, origin, direction, active, sampler, surface, gone);
}

// The same; t is from where the ray began.
static inline Hits first_surface_from(const Scene *scene, const Hits *closest, real3 *origin, real3 direction, ireal active,
                                      Sampler *sampler, Surface *surface) {
    real gone;
    Hits hits = first_stop_from(scene, closest, origin, direction, active, sampler, surface, &gone);
    hits.t += gone;
    return hits;
}

static inline Hits first_surface(const Scene *scene, real3 *origin, real3 direction, ireal active, Sampler *sampler,
                                 Surface *surface) {
    Hits closest = closest_hit(scene, *origin, direction, (real)(INFINITY), active);
    return first_surface_from(scene, &closest, origin, direction, active, sampler, surface);
}

// What part of the light comes through to `origin` from a target, or from infinitely far along wi.
static inline real transmittance(const Scene *scene, real3 origin, real3 target, real3 wi, ireal infinite, ireal active) {
    real left = active ? ONE : ZERO;
    real3 from = origin;
    for (int layer = 0; layer < MOST_LAYERS; ++layer) {
        real3 direction = choose(infinite, wi, sub(target, from));
        ireal open = left > 0.0f;
        Hits hits = closest_hit(scene, from, direction, infinite ? (real)(INFINITY) : ONE, open);
        ireal hit = open & (hits.primitive >= 0);
        if (!ANY(hit)) return left;
        Surface surface = surface_at(scene, from, direction, &hits);
        left = hit ? left * (1.0f - opacity_at(scene, &surface, direction)) : left;
        from = choose(hit, behind(&surface, direction), from);
    }
    return ZERO;
}
