// Cook–Torrance over Lambert (Suchiński 6.5–6.15, Nadolny 3.5–3.13):
//   f = F(wi·h)·G·D/(4·cos wi·cos wo) + (1 − F(cos wi))(1 − F(cos wo))·albedo/pi
// with F(c) = f0 + (1 − f0)(1 − c)^5 and h the half vector.
//
// The sources, and glTF, weigh Lambert by 1 − F(wi·h). That makes light: a white plastic of roughness 0.1 reflects
// 1.7 times what it gets at grazing angles. Light that reaches the body crosses the surface twice, which the two
// factors stand for; they are reciprocal and never sum to more than 1 with the specular part, further bounces included.
//
// D is GGX, and the microfacet lobe draws normals visible from wo (ggx.cl); it and the cosine lobe are chosen by the Fresnel
// term at wo.
//
// MULTIPLE_SCATTERING adds what further bounces between microfacets reflect, as clrt/scene/microfacets.py says:
//   multiple·loss(cos wi)·loss(cos wo)/pi
// The loss is near 0.1 at cos ≈ alpha and falls with 1/cos² behind; a lobe of its own is drawn with about that density.
//
// SPECULAR: f0 of what is no metal times specular·specular_color, and F ends at `specular` (glTF's KHR_materials_specular).
// LAYERS: what lies on it and passes through it (layers.cl).
#include "bsdf/ggx.cl"
#include "bsdf/interface.cl"
#include SHEEN_FILE

#if LAYERS
#define BASE(name) base_##name
#else
#define BASE(name) metallic_roughness_##name
#endif
#define LOSS_COEFFICIENTS ((int)(sizeof(((MetallicRoughness *)0)->loss) / sizeof(float)))

struct metallic_roughness {
    real3 albedo, f0;
    real alpha;
    ireal smith;
#if MULTIPLE_SCATTERING
    real3 multiple;
    real mean_loss, width, spread;
    real loss[LOSS_COEFFICIENTS];
#endif
#if SPECULAR
    real f90;
#endif
#if CLEARCOAT
    real coat, coat_alpha;
#endif
#if COAT_NORMALS
    Frame base_frame, coat_frame;   // in that of the unbent normal
#endif
#if SHEEN
    real3 sheen;
    Fibres fibres;
#endif
#if THROUGH
    real3 through;
#endif
};

static inline struct metallic_roughness metallic_roughness_at(const Scene *scene, ireal index, const Surface *surface) {
    struct metallic_roughness m;
    real3 color = COLOR(metallic_roughness), specular = PARAMETER3(metallic_roughness, f0);
    real metallic = PARAMETER(metallic_roughness, metallic), roughness = PARAMETER(metallic_roughness, roughness);
#if SPECULAR
    real factor = PARAMETER(metallic_roughness, specular);
    specular = mul(specular, PARAMETER3(metallic_roughness, specular_color));
    specular = scale(vector(minimum(specular.x, ONE), minimum(specular.y, ONE), minimum(specular.z, ONE)), factor);
    m.f90 = factor + (1.0f - factor) * metallic;
#endif
    m.f0 = mad3(sub(color, specular), metallic, specular);
    m.albedo = scale(color, 1.0f - metallic);
    m.alpha = maximum(roughness * roughness, (real)(ALPHA_MIN));
    m.smith = TO_INT(PARAMETER(metallic_roughness, smith));
#if MULTIPLE_SCATTERING
    m.multiple = PARAMETER3(metallic_roughness, multiple);
    m.mean_loss = PARAMETER(metallic_roughness, mean_loss);
    m.width = PARAMETER(metallic_roughness, width);
    m.spread = PARAMETER(metallic_roughness, spread);
    for (int k = 0; k < LOSS_COEFFICIENTS; ++k) m.loss[k] = GATHER(real, scene->metallic_roughness, index, .loss[k]);
#endif
#if CLEARCOAT
    m.coat = PARAMETER(metallic_roughness, clearcoat);
    m.coat_alpha = maximum(square(PARAMETER(metallic_roughness, clearcoat_roughness)), (real)(ALPHA_MIN));
#endif
#if COAT_NORMALS
    Frame frame = frame_around(surface->unbent);
    m.base_frame = frame_around(to_local(frame, surface->ns));
    m.coat_frame = frame_around(to_local(frame, surface->coat_normal));
#endif
#if SHEEN
    m.sheen = PARAMETER3(metallic_roughness, sheen_color);
    m.fibres = fibres_of(PARAMETER(metallic_roughness, sheen_roughness));
#endif
#if THROUGH
    real transmission = PARAMETER(metallic_roughness, transmission);
    m.through = scale(m.albedo, transmission);
    m.albedo = scale(m.albedo, 1.0f - transmission);
#endif
    return m;
}

#if MULTIPLE_SCATTERING
// What a single bounce with F = 1 loses of light from an angle: a polynomial in a stretched cosine.
static inline real microfacet_loss(const struct metallic_roughness *m, real cos_theta) {
    real q = cos_theta / (cos_theta + m->width);
    real x = 2.0f * sqrt(q * (1.0f + m->width)) - 1.0f;
    real sum = ZERO;
    for (int k = LOSS_COEFFICIENTS - 1; k >= 0; --k) sum = sum * x + m->loss[k];
    return maximum((1.0f - q) * sum, ZERO);
}

// Around +z with a density of cos² + alpha² in cos²: pdf = cos/(pi·spread·(cos² + alpha²)), spread = log(1 + 1/alpha²).
static inline real3 sample_multiple(const struct metallic_roughness *m, real2 u) {
    real s, c, z2 = minimum(m->alpha * m->alpha * (exp(u.x * m->spread) - 1.0f), ONE), r = sqrt(1.0f - z2);
    sincos_turns(u.y, &s, &c);
    return vector(r * c, r * s, sqrt(z2));
}
static inline real multiple_pdf(const struct metallic_roughness *m, real cos_theta) {
    return cos_theta / (PI * m->spread * (cos_theta * cos_theta + m->alpha * m->alpha));
}
#endif

#if SPECULAR
#define F90(m) ((m)->f90)
#else
#define F90(m) ONE
#endif

// Schlick's F, which ends at F90.
static inline real3 base_fresnel(const struct metallic_roughness *m, real cos_theta) {
    real c = maximum(1.0f - cos_theta, ZERO), c2 = c * c;
    return mad3(sub(splat(F90(m)), m->f0), c2 * c2 * c, m->f0);
}

// 1 − F, with 1 − (1 − c)^5 multiplied out so that it keeps its digits at grazing angles.
static inline real3 transmitted(const struct metallic_roughness *m, real c) {
    real rest = c * (5.0f - c * (10.0f - c * (10.0f - c * (5.0f - c))));
    return mad3(sub(splat(F90(m)), m->f0), rest, splat(1.0f - F90(m)));
}

// G2 by the forms that the scene's materials use.
static inline real shadowing(const struct metallic_roughness *m, real3 wo, real3 wi) {
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

// The lobes' probabilities: their shares of the reflected light, judged by the Fresnel term at wo.
typedef struct { real specular, multiple, diffuse; } LobeShares;

static inline LobeShares lobe_shares(const struct metallic_roughness *m, real3 wo) {
    real3 f = base_fresnel(m, wo.z);
    LobeShares share = {luminance(f), ZERO, luminance(mul(sub(splat(ONE), f), m->albedo))};
#if MULTIPLE_SCATTERING
    share.multiple = luminance(m->multiple) * m->mean_loss * microfacet_loss(m, wo.z);
#endif
    real sum = share.specular + share.multiple + share.diffuse;
    ireal some = sum > 0.0f;
    return (LobeShares){some ? share.specular / sum : ONE, some ? share.multiple / sum : ZERO,
                        some ? share.diffuse / sum : ZERO};
}

// What the body reflects.
static inline real3 BASE(matte)(const struct metallic_roughness *m, real3 wo, real3 wi) {
    real3 body = scale(mul(mul(transmitted(m, wi.z), transmitted(m, wo.z)), m->albedo), wi.z * (1.0f / PI));
    return choose((wo.z > 0.0f) & (wi.z > 0.0f), body, splat(ZERO));
}

static inline real3 BASE(eval)(const struct metallic_roughness *m, real3 wo, real3 wi) {
    real3 sum = add(wo, wi);
    real length = length3(sum);
    real3 h = scale(sum, 1.0f / length);
    real3 f = base_fresnel(m, 0.5f * length);     // wi·h = wo·h, which as products differ near wi = −wo
    real specular = ggx_d(h, m->alpha) * shadowing(m, wo, wi) / (4.0f * wo.z);
    real3 crossing = mul(transmitted(m, wi.z), transmitted(m, wo.z));
    real3 body = mul(crossing, m->albedo);
#if MULTIPLE_SCATTERING
    body = mad3(m->multiple, microfacet_loss(m, wo.z) * microfacet_loss(m, wi.z), body);
#endif
    real3 diffuse = scale(body, wi.z * (1.0f / PI));
    return choose((wo.z > 0.0f) & (wi.z > 0.0f), mad3(f, specular, diffuse), splat(ZERO));
}

static inline real BASE(pdf)(const struct metallic_roughness *m, real3 wo, real3 wi) {
    real3 h = normalize3(add(wo, wi));
    real visible = ggx_d(h, m->alpha) / (4.0f * wo.z * (1.0f + ggx_lambda(wo, m->alpha)));
    LobeShares share = lobe_shares(m, wo);
    real pdf = share.specular * visible + share.diffuse * cosine_pdf(wi.z);
#if MULTIPLE_SCATTERING
    pdf += share.multiple > 0.0f ? share.multiple * multiple_pdf(m, wi.z) : ZERO;   // spread is 0 where there is none
#endif
    return ((wo.z > 0.0f) & (wi.z > 0.0f)) ? pdf : ZERO;
}

// As if no light were lost between microfacets: f0, and what goes through the surface twice: (1 − f0) of it straight in,
// and (1 − f0)·20/21, the cosine-weighted mean of 1 − F, out again.
static inline real3 BASE(albedo)(const struct metallic_roughness *m) {
    real3 in = sub(splat(ONE), m->f0);
    return mad3(mul(mul(in, in), m->albedo), (real)(20.0f / 21.0f), m->f0);
}

static inline BsdfSample BASE(sample)(const struct metallic_roughness *m, real3 wo, real2 u, real lobe) {
    real3 h = sample_visible_normal(wo, m->alpha, u);
    real3 reflected = sub(scale(h, 2.0f * dot3(wo, h)), wo);
    BsdfSample sample = no_sample();
    LobeShares share = lobe_shares(m, wo);
    sample.wi = choose(lobe < share.specular, reflected, sample_cosine(u));
#if MULTIPLE_SCATTERING
    sample.wi = choose(lobe >= 1.0f - share.multiple, sample_multiple(m, u), sample.wi);
#endif
    sample.pdf = BASE(pdf)(m, wo, sample.wi);
    real inverse = sample.pdf > 0.0f ? 1.0f / sample.pdf : ZERO;
    sample.weight = scale(BASE(eval)(m, wo, sample.wi), inverse);
    return sample;
}

#include LAYERS_FILE
