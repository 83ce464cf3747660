// Material evaluation at a hit, in the frame of the shading normal:
//
//   shading_eval(shading, surface, wi)           bsdf_eval: value and pdf, 0 if wi is on the wrong geometric side:
//                                                reflected light belongs above the surface, transmitted light below
//   shading_sample(shading, surface, u, lobe)    bsdf_sample, with wi in the world frame; pdf 0 if sampling failed
//   absorption_along(shading, surface, wi, here) absorption coefficient along wi, per unit of length; wo's is `here`
//
// wi: unit, world frame. HORIZON: light that lobes around a bent or interpolated normal scatter to the wrong side is
// not lost (surface/horizon.cl).
#include "bsdf/dispatch.cl"

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
#if HORIZON
    real3 ng;        // local
#endif
} Shading;

// Apply the normal map, turn the surface towards the origin of a ray along `direction`, and read its material.
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
#if HORIZON
    shading.ng = to_local(shading.frame, surface->ng);
#endif
    return shading;
}

#if HORIZON
// The fraction of diffuse light from w (local) that bump shadowing removes.
static inline real taken_by_bumps(const Shading *shading, const Surface *surface, real3 w) {
#if NORMAL_MAPS
    return 1.0f - bump_shadowing(surface, to_world(shading->frame, w));
#else
    return ZERO;
#endif
}
#endif

static inline BsdfValue shading_eval(const Shading *shading, const Surface *surface, real3 wi) {
    real3 w = to_local(shading->frame, wi);
    real side = dot3(wi, surface->ng);
    BsdfValue at = bsdf_eval(&shading->bsdf, shading->wo, w);
#if HORIZON
    at.value = mad3(at.matte, -taken_by_bumps(shading, surface, w), at.value);
#endif
    at = choose_value(same_side(w.z, side), at, no_value());
#if HORIZON
    add_folded(&shading->bsdf, shading->ng, shading->wo, w, side, &at);
#endif
    return at;
}

#if HORIZON
#if TRANSMISSION
#define SPREAD(sample) (sample)->spread
#else
#define SPREAD(sample) ONE
#endif

// Mirror a sample that was drawn on the wrong side. Its weight accounts for both directions that map to the result.
static inline void fold_sample(const Shading *shading, const Surface *surface, BsdfSample *sample) {
    real3 drawn = sample->wi;
    BsdfValue own = {scale(sample->weight, sample->pdf * SPREAD(sample)), sample->matte, sample->pdf};
    real side = dot3(drawn, shading->ng);
    real3 mirrored = mirrored_at(shading->ng, drawn, side);
    ireal moved = !same_side(drawn.z, side), both = ends_on_side(mirrored, moved ? -side : side);
    sample->wi = choose(moved, mirrored, drawn);
    BsdfValue folded = no_value();
    if (ANY(both)) {
        BsdfValue other = choose_value(both, bsdf_eval(&shading->bsdf, shading->wo, mirrored), folded);
        folded = choose_value(moved, own, other);
        own = choose_value(moved, other, own);
    }
    real taken = taken_by_bumps(shading, surface, sample->wi), pdf = own.pdf + folded.pdf;
    real3 value = add(mad3(own.matte, -taken, own.value), sub(folded.value, folded.matte));
    ireal changed = (both | (taken > 0.0f)) & (sample->pdf > 0.0f) & !sample->specular;
    sample->weight = choose(changed, scale(value, 1.0f / (pdf * SPREAD(sample))), sample->weight);
    sample->pdf = changed ? pdf : sample->pdf;
}
#endif

static inline BsdfSample shading_sample(const Shading *shading, const Surface *surface, real2 u, real lobe) {
    BsdfSample sample = bsdf_sample(&shading->bsdf, shading->wo, u, lobe);
#if HORIZON
    fold_sample(shading, surface, &sample);
#endif
    real belongs = sample.wi.z;
    sample.wi = to_world(shading->frame, sample.wi);
    sample.pdf = same_side(belongs, dot3(sample.wi, surface->ng)) ? sample.pdf : ZERO;
    return sample;
}

#if ATTENUATION
static inline real3 absorption_along(const Shading *shading, const Surface *surface, real3 wi, real3 here) {
    return choose(dot3(wi, surface->ng) < 0.0f, absorption_beyond(&shading->bsdf, here), here);
}
#endif

// The normal used to choose lights: lights behind it contribute nothing. 0 if light from either side counts.
static inline real3 choosing_normal(const Shading *shading) {
#if TRANSMISSION_LOBES
    return choose(is_lit_from_behind(&shading->bsdf), splat(ZERO), shading->frame.n);
#else
    return shading->frame.n;
#endif
}
#endif
