// Smooth glass or water: light is reflected with the probability F that Fresnel's equations give, and else refracted by
// Snell's law (pbrt, 4th ed., 9.3 and 9.5). `ior` inside, 1 outside; what is refracted is multiplied by `color`.
#include "bsdf/interface.cl"

// F for unpolarised light that comes at cos_o > 0 to a medium eta times as dense; cos_t of what is refracted, 0 if nothing.
static inline real fresnel_dielectric(real cos_o, real eta, real *cos_t) {
    real cos2_t = ((eta - 1.0f) * (eta + 1.0f) + cos_o * cos_o) / (eta * eta);   // 1 − sin²/eta² without cancellation
    *cos_t = safe_sqrt(cos2_t);
    real parallel = (eta * cos_o - *cos_t) / (eta * cos_o + *cos_t);
    real perpendicular = (cos_o - eta * *cos_t) / (cos_o + eta * *cos_t);
    real reflected = 0.5f * (parallel * parallel + perpendicular * perpendicular);
    return cos2_t > 0.0f ? reflected : ONE;
}

struct dielectric { real3 color; real eta; };   // eta: index of refraction beyond the surface over that on wo's side

static inline struct dielectric dielectric_at(const Scene *scene, ireal index, const Surface *surface) {
    real ior = PARAMETER(dielectric, ior);
    return (struct dielectric){COLOR(dielectric), surface->front ? ior : 1.0f / ior};
}

static inline real3 dielectric_eval(const struct dielectric *m, real3 wo, real3 wi) { return splat(ZERO); }

static inline real dielectric_pdf(const struct dielectric *m, real3 wo, real3 wi) { return ZERO; }

static inline real3 dielectric_albedo(const struct dielectric *m) { return m->color; }

static inline BsdfSample dielectric_sample(const struct dielectric *m, real3 wo, real2 u, real lobe) {
    real cos_t;
    ireal reflected = lobe < fresnel_dielectric(wo.z, m->eta, &cos_t);
    real to_inside = 1.0f / m->eta;
    BsdfSample sample = no_sample();
    sample.wi = choose(reflected, vector(-wo.x, -wo.y, wo.z), vector(-wo.x * to_inside, -wo.y * to_inside, -cos_t));
    sample.weight = choose(reflected, splat(ONE), m->color);
    sample.pdf = ONE;
    sample.spread = reflected ? ONE : to_inside * to_inside;
    sample.specular = ALL_LANES;
    return sample;
}
