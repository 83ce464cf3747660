// Trivial light selection for a single light (see light/choice.cl).
#include "sampler/interface.cl"

static inline ireal pick_light(const Scene *scene, real3 p, real3 n, Sampler *sampler, real *u, real *probability) {
    *probability = ONE;
    return (ireal)(0);
}

static inline real light_probability(const Scene *scene, real3 p, real3 n, ireal light) { return ONE; }
