// What every material's file provides, by its name:
//
//   NAME_eval(scene, index, front, wo, wi)           f·|cos wi|
//   NAME_pdf(scene, index, front, wo, wi)            density per solid angle with which NAME_sample chooses wi
//   NAME_sample(scene, index, front, wo, u, lobe)    a direction with its weight f·|cos|/pdf; u in [0,1)², lobe in [0,1)
//   NAME_albedo(scene, index)                        what part of white light from straight above it reflects or lets
//                                                    through, in [0, 1]
//
// wo, wi: unit, local frame, both pointing away from the surface, +z the shading normal on the side of wo; front:
// whether that is the surface's outside. wi.z < 0 goes through it: then the material is among TRANSMISSION's.
#include "vector.cl"

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
