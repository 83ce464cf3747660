// Lambert: f = color/pi, the same towards every direction of the upper half. Source: Suchiński 6.2.
#include "sampling.cl"
#include "bsdf/interface.cl"

static inline real3 diffuse_eval(const Scene *scene, ireal index, ireal front, real3 wo, real3 wi) {
    return scale(GATHER3(scene->diffuse, index, .color), wo.z > 0.0f ? cosine_pdf(wi.z) : ZERO);
}

static inline real diffuse_pdf(const Scene *scene, ireal index, ireal front, real3 wo, real3 wi) { return cosine_pdf(wi.z); }

static inline real3 diffuse_albedo(const Scene *scene, ireal index) {
    return GATHER3(scene->diffuse, index, .color);
}

static inline BsdfSample diffuse_sample(const Scene *scene, ireal index, ireal front, real3 wo, real2 u, real lobe) {
    BsdfSample sample = no_sample();
    sample.wi = sample_cosine(u);
    sample.pdf = cosine_pdf(sample.wi.z);
    sample.weight = GATHER3(scene->diffuse, index, .color);
    return sample;
}
