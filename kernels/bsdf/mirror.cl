// A perfect mirror: all light comes from one direction, times color. Source: Suchiński 7.5.
#include "bsdf/interface.cl"

static inline real3 mirror_eval(const Scene *scene, ireal index, ireal front, real3 wo, real3 wi) { return splat(ZERO); }

static inline real mirror_pdf(const Scene *scene, ireal index, ireal front, real3 wo, real3 wi) { return ZERO; }

static inline real3 mirror_albedo(const Scene *scene, ireal index) {
    return GATHER3(scene->mirror, index, .color);
}

static inline BsdfSample mirror_sample(const Scene *scene, ireal index, ireal front, real3 wo, real2 u, real lobe) {
    BsdfSample sample = no_sample();
    sample.wi = vector(-wo.x, -wo.y, wo.z);
    sample.pdf = ONE;
    sample.weight = GATHER3(scene->mirror, index, .color);
    sample.specular = ALL_LANES;
    return sample;
}
