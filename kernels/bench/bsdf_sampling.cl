// Replaces integrator/mis.cl: BSDF sampling finds all light except that of delta lights.
#include "core/sampling.cl"

static inline real light_sample_weight(real pdf, real bsdf_pdf) { return ZERO; }

static inline real bsdf_sample_weight(real pdf, real light_pdf) { return ONE; }
