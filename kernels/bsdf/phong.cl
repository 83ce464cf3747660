// Phong reflection (Nadolny 3.1 to 3.3), in the path integrators in the reciprocal and energy-conserving form of
// Lafortune and Willems (1994, "Using the modified Phong reflectance model for physically based rendering"):
//   f = color/pi + specular·(n + 2)/(2·pi)·cos^n a
// with n = shininess, and a the angle between wi and the mirrored wo. The part of the lobe below the horizon is lost.
#include "bsdf/phong_lobes.cl"

struct phong { PowerLobes lobes; };

static inline struct phong phong_at(const Scene *scene, ireal index, const Surface *surface) {
    struct phong m = {power_lobes(COLOR(phong), PARAMETER3(phong, specular), PARAMETER(phong, shininess), AMBIENT(phong))};
    return m;
}

static inline real mirrored_cosine(real3 wo, real3 wi) { return wo.z * wi.z - wo.x * wi.x - wo.y * wi.y; }

static inline BsdfValue phong_eval(const struct phong *m, real3 wo, real3 wi) {
    real lobe = power(maximum(mirrored_cosine(wo, wi), ZERO), m->lobes.shininess);
#if LOCAL
    real3 value = mad3(m->lobes.color, wi.z, scale(m->lobes.specular, lobe));
#else
    real3 value = scale(mad3(m->lobes.specular, (0.5f * m->lobes.shininess + 1.0f) * lobe, m->lobes.color), wi.z);
#endif
    real share = gloss_share(&m->lobes);
    real pdf = share * power_pdf(mirrored_cosine(wo, wi), m->lobes.shininess) + (1.0f - share) * cosine_pdf(wi.z);
    BsdfValue at = {scale(value, (real)(1.0f / PI)), scale(m->lobes.color, wi.z * (1.0f / PI)), pdf};
    return choose_value((wo.z > 0.0f) & (wi.z > 0.0f), at, no_value());
}

static inline real3 phong_albedo(const struct phong *m) { return lobes_albedo(&m->lobes); }

static inline BsdfSample phong_sample(const struct phong *m, real3 wo, real2 u, real lobe) {
    Frame mirrored = frame_around(vector(-wo.x, -wo.y, wo.z));
    BsdfSample sample = no_sample();
    sample.wi = choose(lobe < gloss_share(&m->lobes), to_world(mirrored, sample_power(u, m->lobes.shininess)),
                       sample_cosine(u));
    weigh_sample(&sample, phong_eval(m, wo, sample.wi), ALL_LANES);
    return sample;
}
