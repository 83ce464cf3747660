// Replaces integrator/mis.cl: light sampling finds all light except what it samples never or hardly: skies below or near
// their mean, and light along specular directions.
#include "core/sampling.cl"

#define HARDLY 0.01f   // of the density of BSDF sampling: weights stay below 1/HARDLY, so that their mean is found soon

static inline real light_sample_weight(real pdf, real bsdf_pdf) { return pdf > HARDLY * bsdf_pdf ? ONE : ZERO; }

static inline real bsdf_sample_weight(real pdf, real light_pdf) { return light_pdf > HARDLY * pdf ? ZERO : ONE; }
