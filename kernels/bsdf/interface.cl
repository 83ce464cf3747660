// What every material's file provides, by its name:
//
//   NAME_eval(scene, index, wo, wi)            f·|cos wi|
//   NAME_pdf(scene, index, wo, wi)             density per solid angle with which NAME_sample chooses wi
//   NAME_sample(scene, index, wo, u, lobe)     a direction with its weight f·|cos|/pdf; u in [0,1)², lobe in [0,1)
//
// wo, wi: unit, local frame, both pointing away from the surface, +z the shading normal on the side of wo.
#include "vector.cl"

typedef struct {
    real3 weight, wi;
    real pdf;
    ireal specular;     // a single direction: eval and pdf are zero for it, and no light sample can find it
} BsdfSample;
