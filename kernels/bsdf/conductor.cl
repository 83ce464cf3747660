// A metal with a complex index of refraction eta + i·k: exact Fresnel equations at GGX microfacets, sampled by visible
// normals. f = F(wi·h)·G·D/(4·cos wi·cos wo), with height-correlated G (SEPARABLE_CONDUCTOR: or separable); single
// bounce. ANISOTROPIC_CONDUCTOR: with two roughnesses, along and across the surface's tangent. Local frame.
//
// Measured metals are published as eta and k, with which Fresnel's equations are exact in each channel. F0 with a tint
// at 82° (Hoffman 2019; Kutz et al. 2021) would fit these curves, but needs a fit for every metal.
#include "bsdf/ggx.cl"
#include "bsdf/interface.cl"
#include BECKMANN_FILE
#include BRUSH_FILE

struct conductor {
    real3 eta, k;
    real alpha;         // of anisotropic metal the geometric mean
#if TINTED_CONDUCTOR
    real3 reflectance;
#endif
#if BECKMANN_CONDUCTOR
    ireal beckmann;     // whether the distribution is Beckmann's
#endif
#if SEPARABLE_CONDUCTOR
    ireal separable;    // whether G is
#endif
#if ANISOTROPIC_CONDUCTOR
    Brush brush;
#endif
};

#if ANISOTROPIC_CONDUCTOR
#define STRETCHED_METAL(m, w) stretch(&(m)->brush, to_brush(&(m)->brush, w))
#define SQUEEZED_METAL(m, h) squeeze(&(m)->brush, to_brush(&(m)->brush, h))
#else
#define STRETCHED_METAL(m, w) w
#define SQUEEZED_METAL(m, h) h
#endif

static inline struct conductor conductor_at(const Scene *scene, ireal index, const Surface *surface) {
    real roughness = PARAMETER(conductor, roughness);
    real alpha = maximum(roughness * roughness, (real)(ALPHA_MIN));
#if ANISOTROPIC_CONDUCTOR
    real other = PARAMETER(conductor, roughness_across), along = alpha;
    real across = PARAMETER(conductor, anisotropic) > 0.0f ? maximum(other * other, (real)(ALPHA_MIN)) : along;
    alpha = sqrt(along * across);
#endif
    return (struct conductor){PARAMETER3(conductor, eta), PARAMETER3(conductor, k), alpha
#if TINTED_CONDUCTOR
                              , PARAMETER3(conductor, reflectance)
#endif
#if BECKMANN_CONDUCTOR
                              , PARAMETER(conductor, beckmann) > 0.0f
#endif
#if SEPARABLE_CONDUCTOR
                              , PARAMETER(conductor, separable) > 0.0f
#endif
#if ANISOTROPIC_CONDUCTOR
                              , brush_at(surface, along, across)
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
    real length = length3(sum);
    real3 h = SQUEEZED_METAL(m, scale(sum, 1.0f / length));
    real3 stretched_o = STRETCHED_METAL(m, wo), stretched_i = STRETCHED_METAL(m, wi);
    real lambda_o = ggx_lambda(stretched_o, m->alpha), lambda_i = ggx_lambda(stretched_i, m->alpha);
    real3 f = conductor_fresnel(m, 0.5f * length);     // of wi·h = wo·h
    real visible = ggx_d(h, m->alpha) / (4.0f * wo.z * (1.0f + lambda_o));
    real seen = visible * (1.0f + lambda_o) / (1.0f + lambda_o + lambda_i);
#if SEPARABLE_CONDUCTOR
#define SEPARABLE(m) ((m)->separable)
    seen = m->separable ? visible / (1.0f + lambda_i) : seen;
#else
#define SEPARABLE(m) NO_LANES
#endif
#if BECKMANN_CONDUCTOR
    real beckmann = beckmann_d(h, m->alpha) * beckmann_masking(stretched_o, stretched_i, m->alpha, SEPARABLE(m));
    seen = m->beckmann ? beckmann / (4.0f * wo.z) : seen;
#endif
    return choose_value((wo.z > 0.0f) & (wi.z > 0.0f), (BsdfValue){scale(f, seen), splat(ZERO), visible}, no_value());
}

static inline real3 conductor_albedo(const struct conductor *m) { return conductor_fresnel(m, ONE); }

static inline BsdfSample conductor_sample(const struct conductor *m, real3 wo, real2 u, real lobe) {
    real3 h = sample_visible_normal(STRETCHED_METAL(m, wo), m->alpha, u);
#if ANISOTROPIC_CONDUCTOR
    h = from_brush(&m->brush, normalize3(stretch(&m->brush, h)));
#endif
    BsdfSample sample = no_sample();
    sample.wi = sub(scale(h, 2.0f * dot3(wo, h)), wo);
    weigh_sample(&sample, conductor_eval(m, wo, sample.wi), ALL_LANES);
    return sample;
}
