// MIS weights (Veach 1997, ch. 9) of light and BSDF samples of the same light. kernels/bench has alternatives in which
// one of the two strategies finds all light that it can.
#include "core/sampling.cl"

// The weight of a light sample of density `pdf`, which BSDF sampling has with bsdf_pdf.
static inline real light_sample_weight(real pdf, real bsdf_pdf) { return power_heuristic(pdf, bsdf_pdf); }

// The weight of emission found by a BSDF sample of density `pdf`, which light sampling has with light_pdf.
static inline real bsdf_sample_weight(real pdf, real light_pdf) { return power_heuristic(pdf, light_pdf); }
