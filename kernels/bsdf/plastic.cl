// Plastic: a diffuse base under a dielectric coat, single scattering at the coat's microfacets (Jakob 2010, "Mitsuba
// renderer", plastic and roughplastic):
//   f = specular·F(wi·h)·G·D/(4·cos wi·cos wo) + base·T(wi)·T(wo)/pi,   base = color/(ior²·(1 − c·inside))
// with the separable G, the fraction T of light that the coat transmits, and the fraction `inside` of diffuse light that
// it reflects back to the base; c is the color if the base's bounces saturate it (nonlinear), else 1. Local frame.
//
// ROUGH_PLASTIC: T of rough coats is a table over the cosine (clrt/scene/materials/plastic.py); of smooth ones 1 − F.
#include "bsdf/fresnel_dielectric.cl"
#include "bsdf/ggx.cl"
#include "bsdf/interface.cl"
#include BECKMANN_FILE

struct plastic {
    real3 base, specular;
    real ior, alpha, mean;      // mean: of T over diffuse light
#if ROUGH_PLASTIC
    const Scene *scene;
    ireal index, rough;
#endif
#if BECKMANN_PLASTIC
    ireal beckmann;
#endif
};

static inline struct plastic plastic_at(const Scene *scene, ireal index, const Surface *surface) {
    struct plastic m;
    real roughness = PARAMETER(plastic, roughness), nonlinear = PARAMETER(plastic, nonlinear);
    real inside = PARAMETER(plastic, inside);
    real3 color = COLOR(plastic);
    m.ior = PARAMETER(plastic, ior);
    real3 left = sub(splat(1.0f - inside * (1.0f - nonlinear)), scale(color, inside * nonlinear));
    real3 denser = scale(left, m.ior * m.ior);
    m.base = vector(color.x / denser.x, color.y / denser.y, color.z / denser.z);
    m.specular = PARAMETER3(plastic, specular);
    m.alpha = maximum(roughness * roughness, (real)(ALPHA_MIN));
    m.mean = PARAMETER(plastic, mean);
#if ROUGH_PLASTIC
    m.scene = scene;
    m.index = index;
    m.rough = roughness > 0.0f;
#endif
#if BECKMANN_PLASTIC
    m.beckmann = PARAMETER(plastic, beckmann) > 0.0f;
#endif
    return m;
}

#if ROUGH_PLASTIC
// T of rough coats, interpolated linearly between equidistant cosines from 0 to 1.
#define COAT_STEPS ((int)(sizeof(((Plastic *)0)->transmittance) / sizeof(float)) - 1)
static inline real rough_transmittance(const struct plastic *m, real cosine) {
    real place = minimum(cosine, ONE) * (float)COAT_STEPS;
    RealLanes through;
    for (int lane = 0; lane < LANES; ++lane) {
        float at = LANE(place, lane);
        int step = clamp((int)at, 0, COAT_STEPS - 1);   // arbitrary in inactive lanes
        global const float *entry = RECORD(m->scene->plastic, LANE_INT(m->index, lane))->transmittance + step;
        through.lane[lane] = mix(entry[0], entry[1], at - (float)step);
    }
    return through.all;
}
#endif

static inline real coat_transmittance(const struct plastic *m, real cosine) {
    real cos_t, through = 1.0f - fresnel_dielectric(cosine, m->ior, &cos_t);
#if ROUGH_PLASTIC
    through = m->rough ? rough_transmittance(m, cosine) : through;
#endif
    return through;
}

// The fraction of samples given to the coat, by luminance.
static inline real coat_share(const struct plastic *m, real through) {
    real gloss = luminance(m->specular) * (1.0f - through), sum = gloss + luminance(m->base) * through * m->mean;
    return sum > 0.0f ? gloss / sum : ZERO;
}

static inline BsdfValue plastic_eval(const struct plastic *m, real3 wo, real3 wi) {
    real3 sum = add(wo, wi);
    real length = length3(sum), cos_t, through = coat_transmittance(m, wo.z);
    real3 h = scale(sum, 1.0f / length);
    real f = fresnel_dielectric(0.5f * length, m->ior, &cos_t);    // of wi·h = wo·h
    real visible = ggx_d(h, m->alpha) / (4.0f * wo.z * (1.0f + ggx_lambda(wo, m->alpha)));
    real seen = visible / (1.0f + ggx_lambda(wi, m->alpha));
#if BECKMANN_PLASTIC
    real masking = beckmann_masking(wo, wi, m->alpha, ALL_LANES);
    seen = m->beckmann ? beckmann_d(h, m->alpha) * masking / (4.0f * wo.z) : seen;
#endif
    real3 matte = scale(m->base, through * coat_transmittance(m, wi.z) * wi.z * (1.0f / PI));
    real share = coat_share(m, through);
    BsdfValue at = {mad3(m->specular, f * seen, matte), matte, share * visible + (1.0f - share) * cosine_pdf(wi.z)};
    return choose_value((wo.z > 0.0f) & (wi.z > 0.0f), at, no_value());
}

static inline real3 plastic_albedo(const struct plastic *m) {
    real through = coat_transmittance(m, ONE), cos_t;
    real3 gloss = scale(m->specular, fresnel_dielectric(ONE, m->ior, &cos_t));
    real3 sum = mad3(m->base, through * m->mean, gloss);
    return vector(minimum(sum.x, ONE), minimum(sum.y, ONE), minimum(sum.z, ONE));
}

static inline BsdfSample plastic_sample(const struct plastic *m, real3 wo, real2 u, real lobe) {
    real3 h = sample_visible_normal(wo, m->alpha, u);
    real3 mirrored = sub(scale(h, 2.0f * dot3(wo, h)), wo);
    BsdfSample sample = no_sample();
    sample.wi = choose(lobe < coat_share(m, coat_transmittance(m, wo.z)), mirrored, sample_cosine(u));
    weigh_sample(&sample, plastic_eval(m, wo, sample.wi), ALL_LANES);
    return sample;
}
