// The interface of a material; its file provides, with NAME being its name:
//
//   struct NAME                              parameters at the hit, of every lane
//   NAME_at(scene, index, surface)           reads them: PARAMETER(NAME, x), PARAMETER3(NAME, x) for its
//                                            dataclass's x, and COLOR(NAME) for its color
//   NAME_eval(m, wo, wi)                     a BsdfValue: f·|cos wi|, and the pdf with which NAME_sample samples wi
//   NAME_sample(m, wo, u, lobe)              a direction with its weight f·|cos|/pdf; u in [0,1)², lobe in [0,1)
//   NAME_albedo(m)                           fraction of white light reflected or transmitted at normal incidence,
//                                            in [0, 1]
//
// m: const struct NAME *. wo, wi: unit, local frame, both pointing away from the surface, +z the shading normal on the
// side of wo; surface->front: whether that is the outside. wi.z < 0 is transmission: the material then has the feature
// TRANSMISSION; also TRANSMISSION_LOBES if eval supports directions beyond the surface, with NAME_transmits(m): whether
// it can be nonzero there; and ATTENUATION if light is absorbed there, with NAME_absorption(m, here): the coefficient
// per unit of length, given `here` on the side of wo. A material without ATTENUATION has no inside either.
#include "surface/surface.cl"

// For each parameter the preamble defines whether any material of its type reads it from a texture: READ_kind_name is
// CONSTANT or TEXTURED.
#define PARAMETER(kind, name) PASTE(READ_##kind##_##name, 1)(kind, name)
#define PARAMETER3(kind, name) PASTE(READ_##kind##_##name, 3)(kind, name)
#define CONSTANT1(kind, name) GATHER(real, scene->kind, index, .name)
#define CONSTANT3(kind, name) GATHER3(scene->kind, index, .name)
#define TEXTURED1(kind, name) \
    textured(scene, GATHER(ireal, scene->kind, index, .name##_texture), CONSTANT1(kind, name), &surface->at)
#define TEXTURED3(kind, name) \
    textured3(scene, GATHER(ireal, scene->kind, index, .name##_texture), CONSTANT3(kind, name), &surface->at)
#if VERTEX_COLORS
#define COLOR(kind) mul(PARAMETER3(kind, color), surface->tint)
#else
#define COLOR(kind) PARAMETER3(kind, color)
#endif

// Value and pdf of one direction wi, evaluated together because they share most of their terms.
typedef struct {
    real3 value;        // f·|cos wi|, `spread` included
    real3 matte;        // the diffuse part of it, close to Lambert's law (surface/horizon.cl)
    real pdf;           // pdf per solid angle
} BsdfValue;

typedef struct {
    real3 weight, wi;
    real pdf;
#if HORIZON
    real3 matte;        // as in BsdfValue
#endif
#if TRANSMISSION
    real spread;        // factor besides the weight: radiance along wo over that along wi, due to refraction
#endif
    ireal specular;     // a single direction: eval is 0 for it, and no light sample can find it
} BsdfSample;

// The initial value of a sample: failed.
static inline BsdfSample no_sample() {
    BsdfSample sample;
    sample.weight = splat(ZERO);
    sample.wi = vector(ZERO, ZERO, ONE);
    sample.pdf = ZERO;
    sample.specular = NO_LANES;
#if HORIZON
    sample.matte = splat(ZERO);
#endif
#if TRANSMISSION
    sample.spread = ONE;
#endif
    return sample;
}

// Set the weight and pdf of a sample from the value of its direction; lanes outside `kept` fail.
static inline void weigh_sample(BsdfSample *sample, BsdfValue at, ireal kept) {
    sample->pdf = kept ? at.pdf : ZERO;
    real inverse = sample->pdf <= 0.0f ? ZERO : 1.0f / sample->pdf;
    sample->weight = scale(at.value, inverse);
#if HORIZON
    sample->matte = at.matte;
#endif
}

static inline BsdfValue no_value() { return (BsdfValue){splat(ZERO), splat(ZERO), ZERO}; }

static inline BsdfValue choose_value(ireal mask, BsdfValue a, BsdfValue b) {
    return (BsdfValue){choose(mask, a.value, b.value), choose(mask, a.matte, b.matte), mask ? a.pdf : b.pdf};
}
