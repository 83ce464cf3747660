// The weights of multiple importance sampling (Veach 1997, ch. 9) where the light's and the BSDF's samples find the same
// light. kernels/study has others, by which one of the two strategies finds all that it can.
#include "sampling.cl"

// Of a light sample of density `pdf`, which the BSDF would sample with bsdf_pdf.
static inline real light_sample_weight(real pdf, real bsdf_pdf) { return power_heuristic(pdf, bsdf_pdf); }

// Of light that a BSDF sample of density `pdf` found, and a light sample would with light_pdf.
static inline real bsdf_sample_weight(real pdf, real light_pdf) { return power_heuristic(pdf, light_pdf); }
