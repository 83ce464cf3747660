// In place of mis.cl: light sampling finds all light but what it never samples: skies below their mean, and what specular
// directions lead to.
#include "sampling.cl"

static inline real light_sample_weight(real pdf, real bsdf_pdf) { return ONE; }

static inline real bsdf_sample_weight(real pdf, real light_pdf) { return light_pdf > 0.0f ? ZERO : ONE; }
