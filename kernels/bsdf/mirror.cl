// A perfect mirror: specular reflection times color. Source: Suchiński 7.5.
#include "bsdf/interface.cl"

struct mirror { real3 color; };

static inline struct mirror mirror_at(const Scene *scene, ireal index, const Surface *surface) {
    return (struct mirror){COLOR(mirror)};
}

static inline BsdfValue mirror_eval(const struct mirror *m, real3 wo, real3 wi) { return no_value(); }

static inline real3 mirror_albedo(const struct mirror *m) { return m->color; }

static inline BsdfSample mirror_sample(const struct mirror *m, real3 wo, real2 u, real lobe) {
    BsdfSample sample = no_sample();
    sample.wi = vector(-wo.x, -wo.y, wo.z);
    sample.pdf = ONE;
    sample.weight = m->color;
    sample.specular = ALL_LANES;
    return sample;
}
