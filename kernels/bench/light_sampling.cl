// Replaces integrator/mis.cl: light sampling finds all light except what it never samples: skies below their mean, and
// light along specular directions.
#include "core/sampling.cl"

static inline real light_sample_weight(real pdf, real bsdf_pdf) { return ONE; }

static inline real bsdf_sample_weight(real pdf, real light_pdf) { return light_pdf > 0.0f ? ZERO : ONE; }
