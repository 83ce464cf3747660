// Blinn–Phong reflection (Blinn 1977; Nadolny 3.3), with the half vector h instead of the mirrored direction. In the
// path integrators normalised so that a white glossy lobe reflects all light at normal incidence (Giesen 2009, "Phong
// and Blinn–Phong normalization"):
//   f = color/pi + specular·(n + 2)(n + 4)/(8·pi·(2^(−n/2) + n))·cos^n h
// with n = shininess. Less is reflected at other angles.
#include "bsdf/phong_lobes.cl"

struct blinn_phong { PowerLobes lobes; };

static inline struct blinn_phong blinn_phong_at(const Scene *scene, ireal index, const Surface *surface) {
    struct blinn_phong m = {power_lobes(COLOR(blinn_phong), PARAMETER3(blinn_phong, specular), PARAMETER(blinn_phong, shininess), AMBIENT(blinn_phong))};
    return m;
}

static inline BsdfValue blinn_phong_eval(const struct blinn_phong *m, real3 wo, real3 wi) {
    real3 sum = add(wo, wi);
    real length = length3(sum), cos_h = sum.z / length, n = m->lobes.shininess, lobe = power(cos_h, n);
    real share = gloss_share(&m->lobes);
#if LOCAL
    real3 value = mad3(m->lobes.color, wi.z, scale(m->lobes.specular, lobe));
#else
    real brightest = (n + 2.0f) * (n + 4.0f) / (8.0f * (power((real)(0.5f), 0.5f * n) + n));
    real3 value = scale(mad3(m->lobes.specular, brightest * lobe, m->lobes.color), wi.z);
#endif
    // dωi = 4·(wo·h) dωh, with wo·h = |wo + wi|/2.
    real pdf = share * power_pdf(cos_h, n) / (2.0f * length) + (1.0f - share) * cosine_pdf(wi.z);
    BsdfValue at = {scale(value, (real)(1.0f / PI)), scale(m->lobes.color, wi.z * (1.0f / PI)), pdf};
    return choose_value((wo.z > 0.0f) & (wi.z > 0.0f), at, no_value());
}

static inline real3 blinn_phong_albedo(const struct blinn_phong *m) { return lobes_albedo(&m->lobes); }

static inline BsdfSample blinn_phong_sample(const struct blinn_phong *m, real3 wo, real2 u, real lobe) {
    real3 h = sample_power(u, m->lobes.shininess);
    BsdfSample sample = no_sample();
    sample.wi = choose(lobe < gloss_share(&m->lobes), sub(scale(h, 2.0f * dot3(wo, h)), wo), sample_cosine(u));
    weigh_sample(&sample, blinn_phong_eval(m, wo, sample.wi), ALL_LANES);
    return sample;
}
