// A metal with a complex index of refraction eta + i·k: exact Fresnel equations at GGX microfacets, sampled by visible
// normals. f = F(wi·h)·G·D/(4·cos wi·cos wo), with height-correlated G (SEPARABLE_CONDUCTOR: or separable); single
// bounce. Local frame.
//
// Measured metals are published as eta and k, with which Fresnel's equations are exact in each channel. F0 with a tint
// at 82° (Hoffman 2019; Kutz et al. 2021) would fit these curves, but needs a fit for every metal.
#include "bsdf/ggx.cl"
#include "bsdf/interface.cl"
#include BECKMANN_FILE

struct conductor {
    real3 eta, k;
    real alpha;
#if TINTED_CONDUCTOR
    real3 reflectance;
#endif
#if BECKMANN_CONDUCTOR
    ireal beckmann;     // whether the distribution is Beckmann's
#endif
#if SEPARABLE_CONDUCTOR
    ireal separable;    // whether G is
#endif
};

static inline struct conductor conductor_at(const Scene *scene, ireal index, const Surface *surface) {
    real roughness = PARAMETER(conductor, roughness);
    return (struct conductor){PARAMETER3(conductor, eta), PARAMETER3(conductor, k),
                              maximum(roughness * roughness, (real)(ALPHA_MIN))
#if TINTED_CONDUCTOR
                              , PARAMETER3(conductor, reflectance)
#endif
#if BECKMANN_CONDUCTOR
                              , PARAMETER(conductor, beckmann) > 0.0f
#endif
#if SEPARABLE_CONDUCTOR
                              , PARAMETER(conductor, separable) > 0.0f
#endif
    };
}

// F for unpolarised light from vacuum (Born and Wolf, 14.2), with a² + b² = |n² − sin²| for n = eta + i·k. The smaller
// term of 2a² is computed by a division instead of a subtraction, to avoid cancellation.
static inline real fresnel_conductor(real cos_o, real eta, real k) {
    real cos2 = cos_o * cos_o, sin2 = maximum(1.0f - cos2, ZERO);
    real real_part = eta * eta - k * k - sin2, imaginary = 2.0f * eta * k;
    real size = sqrt(real_part * real_part + imaginary * imaginary);
    real twice_a2 = real_part > 0.0f ? size + real_part : imaginary * imaginary / maximum(size - real_part, (real)(1e-30f));
    real along = cos_o * sqrt(2.0f * twice_a2);    // 2a·cos
    real perpendicular = (size + cos2 - along) / (size + cos2 + along);
    real crossing = along * sin2, both = cos2 * size + sin2 * sin2;
    return 0.5f * perpendicular * (1.0f + (both - crossing) / (both + crossing));
}

static inline real3 conductor_fresnel(const struct conductor *m, real cos_o) {
#if TINTED_CONDUCTOR
#define TINTED(f) mul(m->reflectance, f)
#else
#define TINTED(f) f
#endif
    return TINTED(vector(fresnel_conductor(cos_o, m->eta.x, m->k.x), fresnel_conductor(cos_o, m->eta.y, m->k.y),
                         fresnel_conductor(cos_o, m->eta.z, m->k.z)));
}

static inline BsdfValue conductor_eval(const struct conductor *m, real3 wo, real3 wi) {
    real3 sum = add(wo, wi);
    real length = length3(sum), lambda_o = ggx_lambda(wo, m->alpha), lambda_i = ggx_lambda(wi, m->alpha);
    real3 f = conductor_fresnel(m, 0.5f * length);     // of wi·h = wo·h
    real visible = ggx_d(scale(sum, 1.0f / length), m->alpha) / (4.0f * wo.z * (1.0f + lambda_o));
    real seen = visible * (1.0f + lambda_o) / (1.0f + lambda_o + lambda_i);
#if SEPARABLE_CONDUCTOR
#define SEPARABLE(m) ((m)->separable)
    seen = m->separable ? visible / (1.0f + lambda_i) : seen;
#else
#define SEPARABLE(m) NO_LANES
#endif
#if BECKMANN_CONDUCTOR
    real beckmann = beckmann_d(scale(sum, 1.0f / length), m->alpha) * beckmann_masking(wo, wi, m->alpha, SEPARABLE(m));
    seen = m->beckmann ? beckmann / (4.0f * wo.z) : seen;
#endif
    return choose_value((wo.z > 0.0f) & (wi.z > 0.0f), (BsdfValue){scale(f, seen), splat(ZERO), visible}, no_value());
}

static inline real3 conductor_albedo(const struct conductor *m) { return conductor_fresnel(m, ONE); }

static inline BsdfSample conductor_sample(const struct conductor *m, real3 wo, real2 u, real lobe) {
    real3 h = sample_visible_normal(wo, m->alpha, u);
    BsdfSample sample = no_sample();
    sample.wi = sub(scale(h, 2.0f * dot3(wo, h)), wo);
    weigh_sample(&sample, conductor_eval(m, wo, sample.wi), ALL_LANES);
    return sample;
}
