// Replaces light/choice.cl: every light has the same probability everywhere.
#include "sampler/interface.cl"

static inline ireal pick_light(const Scene *scene, real3 p, real3 n, Sampler *sampler, real *u, real *probability) {
    float count = (float)scene->counts.lights;
    real place = *u * count;
    ireal light = TO_INT(minimum(place, (real)(count - 0.5f)));
    *u = minimum(place - TO_REAL(light), BELOW_ONE);
    *probability = (real)(1.0f / count);
    return light;
}

static inline real light_probability(const Scene *scene, real3 p, real3 n, ireal light) {
    return (real)(1.0f / (float)scene->counts.lights);
}
