// Cook–Torrance over Lambert (Suchiński 6.5–6.15, Nadolny 3.5–3.13):
//   f = F(wi·h)·G·D/(4·cos wi·cos wo) + (1 − F(cos wi))(1 − F(cos wo))·albedo/pi
// with F(c) = f0 + (1 − f0)(1 − c)^5 and h the half vector.
//
// The sources, and glTF, weigh Lambert by 1 − F(wi·h). That makes light: a white plastic of roughness 0.1 reflects
// 1.7 times what it gets at grazing angles. Light that reaches the body crosses the surface twice, which the two
// factors stand for; they are reciprocal and never sum to more than 1 with the specular part.
//
// D is GGX (Walter et al. 2007, eq. 33). The microfacet lobe draws normals visible from wo (Dupuy and Benyoub 2023,
// "Sampling Visible GGX Normals with Spherical Caps"); it and the cosine lobe are chosen by the Fresnel term at wo.
#include "sampling.cl"
#include "bsdf/interface.cl"

typedef struct {
    real3 albedo, f0;
    real alpha;
    ireal smith;
} MetallicRoughnessLobes;

static inline MetallicRoughnessLobes metallic_roughness_lobes(const Scene *scene, ireal index) {
    return (MetallicRoughnessLobes){GATHER3(scene->metallic_roughness, index, .albedo),
                                    GATHER3(scene->metallic_roughness, index, .f0),
                                    GATHER(real, scene->metallic_roughness, index, .alpha),
                                    TO_INT(GATHER(real, scene->metallic_roughness, index, .smith))};
}

static inline real3 fresnel_schlick(real3 f0, real cos_theta) {
    real c = maximum(1.0f - cos_theta, ZERO), c2 = c * c;
    return mad3(sub(splat(ONE), f0), c2 * c2 * c, f0);
}

static inline real3 transmitted(real3 f0, real cos_theta) { return sub(splat(ONE), fresnel_schlick(f0, cos_theta)); }

// Walter's D(h), with the denominator summed so that a tiny alpha keeps its digits at the lobe's centre.
static inline real ggx_d(real3 h, real alpha) {
    real a2 = alpha * alpha;
    real s = (h.x * h.x + h.y * h.y) + a2 * h.z * h.z;
    return a2 / (PI * s * s);
}

// Smith's Lambda of GGX; G1 = 1/(1 + Lambda).
static inline real ggx_lambda(real3 w, real alpha) {
    real t = alpha * alpha * (w.x * w.x + w.y * w.y) / (w.z * w.z);
    return 0.5f * t / (1.0f + sqrt(1.0f + t));   // (sqrt(1 + t) − 1)/2 without cancellation
}

// G2 by the forms that the scene's materials use.
static inline real shadowing(const MetallicRoughnessLobes *m, real3 wo, real3 wi) {
    real g = ZERO;
    real lambda_o = ggx_lambda(wo, m->alpha), lambda_i = ggx_lambda(wi, m->alpha);
#if SMITH_HEIGHT_CORRELATED
    g = m->smith == 0 ? 1.0f / (1.0f + lambda_o + lambda_i) : g;
#endif
#if SMITH_SEPARABLE
    g = m->smith == 1 ? 1.0f / ((1.0f + lambda_o) * (1.0f + lambda_i)) : g;
#endif
#if SMITH_SCHLICK || SMITH_SCHLICK_IBL
    real r = sqrt(m->alpha);
    real k = m->smith == 2 ? square(r + 1.0f) * 0.125f : m->alpha * 0.5f;
    real schlick = wo.z * wi.z / ((wo.z * (1.0f - k) + k) * (wi.z * (1.0f - k) + k));
    g = m->smith >= 2 ? schlick : g;
#endif
    return g;
}

// Probability of the microfacet lobe: its share of the reflected light, judged by the Fresnel term at wo.
static inline real specular_probability(const MetallicRoughnessLobes *m, real3 wo) {
    real3 f = fresnel_schlick(m->f0, wo.z);
    real specular = luminance(f);
    real diffuse = luminance(mul(sub(splat(ONE), f), m->albedo));
    return specular + diffuse > 0.0f ? specular / (specular + diffuse) : ONE;
}

static inline real3 metallic_roughness_value(const MetallicRoughnessLobes *m, real3 wo, real3 wi) {
    real3 h = normalize3(add(wo, wi));
    real3 f = fresnel_schlick(m->f0, dot3(wi, h));
    real specular = ggx_d(h, m->alpha) * shadowing(m, wo, wi) / (4.0f * wo.z);
    real3 crossing = mul(transmitted(m->f0, wi.z), transmitted(m->f0, wo.z));
    real3 diffuse = scale(mul(crossing, m->albedo), wi.z * (1.0f / PI));
    return choose((wo.z > 0.0f) & (wi.z > 0.0f), mad3(f, specular, diffuse), splat(ZERO));
}

static inline real metallic_roughness_density(const MetallicRoughnessLobes *m, real3 wo, real3 wi) {
    real3 h = normalize3(add(wo, wi));
    real visible = ggx_d(h, m->alpha) / (4.0f * wo.z * (1.0f + ggx_lambda(wo, m->alpha)));
    real p = specular_probability(m, wo);
    real pdf = p * visible + (1.0f - p) * cosine_pdf(wi.z);
    return ((wo.z > 0.0f) & (wi.z > 0.0f)) ? pdf : ZERO;
}

static inline real3 metallic_roughness_eval(const Scene *scene, ireal index, real3 wo, real3 wi) {
    MetallicRoughnessLobes m = metallic_roughness_lobes(scene, index);
    return metallic_roughness_value(&m, wo, wi);
}

static inline real metallic_roughness_pdf(const Scene *scene, ireal index, real3 wo, real3 wi) {
    MetallicRoughnessLobes m = metallic_roughness_lobes(scene, index);
    return metallic_roughness_density(&m, wo, wi);
}

// A normal visible from wo: stretch, draw a point of the cap of directions, unstretch.
static inline real3 sample_visible_normal(real3 wo, real alpha, real2 u) {
    real3 stretched = normalize3(vector(wo.x * alpha, wo.y * alpha, wo.z));
    real s, c;
    sincos_turns(u.x, &s, &c);
    real z = 1.0f - u.y * (1.0f + stretched.z);
    real radius = safe_sqrt(1.0f - z * z);
    real3 h = add(vector(radius * c, radius * s, z), stretched);
    return normalize3(vector(h.x * alpha, h.y * alpha, maximum(h.z, (real)(1e-30f))));
}

static inline BsdfSample metallic_roughness_sample(const Scene *scene, ireal index, real3 wo, real2 u, real lobe) {
    MetallicRoughnessLobes m = metallic_roughness_lobes(scene, index);
    real3 h = sample_visible_normal(wo, m.alpha, u);
    real3 reflected = sub(scale(h, 2.0f * dot3(wo, h)), wo);
    BsdfSample sample;
    sample.wi = choose(lobe < specular_probability(&m, wo), reflected, sample_cosine(u));
    sample.pdf = metallic_roughness_density(&m, wo, sample.wi);
    real inverse = sample.pdf > 0.0f ? 1.0f / sample.pdf : ZERO;
    sample.weight = scale(metallic_roughness_value(&m, wo, sample.wi), inverse);
    sample.specular = NO_LANES;
    return sample;
}
