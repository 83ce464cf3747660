// What every material's file provides, by its name:
//
//   struct NAME                              its parameters where it was hit, of every lane
//   NAME_at(scene, index, surface)           reads them: PARAMETER(NAME, x), PARAMETER3(NAME, x) for its
//                                            dataclass's x, and COLOR(NAME) for its color
//   NAME_eval(m, wo, wi)                     f·|cos wi|, the spread included
//   NAME_pdf(m, wo, wi)                      density per solid angle with which NAME_sample chooses wi
//   NAME_sample(m, wo, u, lobe)              a direction with its weight f·|cos|/pdf; u in [0,1)², lobe in [0,1)
//   NAME_albedo(m)                           what part of white light from straight above it reflects or lets through,
//                                            in [0, 1]
//   NAME_matte(m, wo, wi)                    the part of NAME_eval that spreads light about as Lambert's law does (horizon.cl)
//
// m: const struct NAME *. wo, wi: unit, local frame, both pointing away from the surface, +z the shading normal on the
// side of wo; surface->front: whether that is the outside. wi.z < 0 goes through it: then the material has the feature
// TRANSMISSION; TRANSMISSION_LOBES, too, where eval and pdf know directions beyond the surface, with NAME_transmits(m):
// whether eval can be other than 0 there; and ATTENUATION with a real3 `absorption` in its struct, where light is absorbed
// there.
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

typedef struct {
    real3 weight, wi;
    real pdf;
#if TRANSMISSION
    real spread;        // radiance along wo over that along wi, which a denser medium bundles, beside the weight
#endif
    ireal specular;     // a single direction: eval and pdf are zero for it, and no light sample can find it
} BsdfSample;

// What a sample is until a material says otherwise.
static inline BsdfSample no_sample() {
    BsdfSample sample;
    sample.weight = splat(ZERO);
    sample.wi = vector(ZERO, ZERO, ONE);
    sample.pdf = ZERO;
    sample.specular = NO_LANES;
#if TRANSMISSION
    sample.spread = ONE;
#endif
    return sample;
}
