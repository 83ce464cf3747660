// Lambertian reflection: f = color/pi over the upper hemisphere. Source: Suchiński 6.2.
#include "core/sampling.cl"
#include "bsdf/interface.cl"

struct diffuse { real3 color; };

static inline struct diffuse diffuse_at(const Scene *scene, ireal index, const Surface *surface) {
    return (struct diffuse){COLOR(diffuse)};
}

static inline BsdfValue diffuse_eval(const struct diffuse *m, real3 wo, real3 wi) {
    real pdf = cosine_pdf(wi.z);
    real3 value = scale(m->color, wo.z > 0.0f ? pdf : ZERO);
    return (BsdfValue){value, value, pdf};
}

static inline real3 diffuse_albedo(const struct diffuse *m) { return m->color; }

static inline BsdfSample diffuse_sample(const struct diffuse *m, real3 wo, real2 u, real lobe) {
    BsdfSample sample = no_sample();
    sample.wi = sample_cosine(u);
    sample.pdf = cosine_pdf(sample.wi.z);
    sample.weight = m->color;
#if HORIZON
    sample.matte = scale(m->color, sample.pdf);
#endif
    return sample;
}
