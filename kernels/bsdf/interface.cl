// What every material's file provides, by its name:
//
//   struct NAME                              its parameters where it was hit, of every lane
//   NAME_at(scene, index, surface)           reads them: PARAMETER(NAME, x), PARAMETER3(NAME, x) for its
//                                            dataclass's x, and COLOR(NAME) for its color
//   NAME_eval(m, wo, wi)                     a BsdfValue: f·|cos wi|, and the density with which NAME_sample chooses wi
//   NAME_sample(m, wo, u, lobe)              a direction with its weight f·|cos|/pdf; u in [0,1)², lobe in [0,1)
//   NAME_albedo(m)                           what part of white light from straight above it reflects or lets through,
//                                            in [0, 1]
//
// m: const struct NAME *. wo, wi: unit, local frame, both pointing away from the surface, +z the shading normal on the
// side of wo; surface->front: whether that is the outside. wi.z < 0 goes through it: then the material has the feature
// TRANSMISSION; TRANSMISSION_LOBES, too, where eval knows directions beyond the surface, with NAME_transmits(m): whether it
// can be other than 0 there; and ATTENUATION, where light is absorbed there, with NAME_absorption(m, here): how much, per
// unit of length, where it is `here` on the side of wo. What has no ATTENUATION has no inside either.
#include "surface.cl"

// The preamble says of each parameter whether some material of its type reads it from a texture: READ_kind_name is
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

// Of one direction wi. Both are evaluated together, since they share most of what they are made of.
typedef struct {
    real3 value;        // f·|cos wi|, the spread included
    real3 matte;        // the part of it that spreads light about as Lambert's law does (horizon.cl)
    real pdf;           // density per solid angle
} BsdfValue;

typedef struct {
    real3 weight, wi;
    real pdf;
#if HORIZON
    real3 matte;        // as in BsdfValue
#endif
#if TRANSMISSION
    real spread;        // radiance along wo over that along wi, which a denser medium bundles, beside the weight
#endif
    ireal specular;     // a single direction: eval is zero for it, and no light sample can find it
} BsdfSample;

// What a sample is until a material says otherwise.
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

// Gives a sample the weight and density of its direction, where those are what `kept` lanes have.
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
