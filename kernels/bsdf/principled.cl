// Disney's principled BSDF (Burley 2012, "Physically Based Shading at Disney"; 2015, "Extending the Disney BRDF to a BSDF
// with Integrated Subsurface Scattering") in the form of Mitsuba 3's `principled`, to which its values are equal. With
// k = 1 − metallic, t = spec_trans, x = spec_tint, and the Schlick weight S(c) = (1 − c)⁵, f·cos wi is the sum of
//   specular reflection   F·D·G/(4·cos wo), F = k·(1 − x)·Fresnel + metallic·Schlick(color) + k·x·Schlick(tint·R0)
//   transmission          k·t·√color·(1 − Fresnel)·D·G, refracted at the microfacets
//   diffuse               k·(1 − t)·color/pi·cos wi·(Burley's lobe, or by the share `flatness` a flat one)
//   sheen                 k·sheen·(color of the sheen)·S(wi·h)·cos wi
//   clearcoat             clearcoat/4·Schlick(.04)·GTR1·G(alpha = .25)·cos wi
// with GGX, separable G, and tint = color/luminance. A material with transmission has an inside, where it has the first
// two lobes alone, with F = k·t·Fresnel. Local frame.
//
// This is an empirical model: the diffuse lobe is not weighted by what the others leave, so white gains energy.
//
// PRINCIPLED_TRANSMISSION, _TINT (specular), _SHEEN, _FLATNESS, _CLEARCOAT, _ANISOTROPY: these parameters.
#include "bsdf/fresnel_dielectric.cl"
#include "bsdf/ggx.cl"
#include "bsdf/interface.cl"
#include BRUSH_FILE

#define PRINCIPLED_ALPHA_MIN 1e-3f
#define COAT_F0 0.04f
#define COAT_SHADOWING 0.25f    // alpha of the clearcoat's G
// Approximate albedo of white sheen: LOW + HIGH·(1 − cos wo)².
#define SHEEN_LOW 3e-4f
#define SHEEN_HIGH 0.088f

// F at a microfacet: dielectric·Fresnel + mix(f0, grazing, S).
struct principled {
    real3 body;             // albedo of the diffuse lobe
    real3 f0;
    real dielectric, grazing;
    real ior;               // beyond the surface, over that on wo's side
    real roughness, alpha;  // alpha: of anisotropic surfaces the geometric mean
#if PRINCIPLED_TRANSMISSION
    real3 passing;          // k·t·√color
#endif
#if PRINCIPLED_SHEEN
    real3 sheen;
#endif
#if PRINCIPLED_FLATNESS
    real flatness;
#endif
#if PRINCIPLED_CLEARCOAT
    real coat, coat_alpha;  // coat: clearcoat/4
#endif
#if PRINCIPLED_ANISOTROPY
    Brush brush;
#endif
};

#if PRINCIPLED_ANISOTROPY
#define STRETCHED_FACETS(m, w) stretch(&(m)->brush, to_brush(&(m)->brush, w))
#define SQUEEZED_FACETS(m, h) squeeze(&(m)->brush, to_brush(&(m)->brush, h))
#else
#define STRETCHED_FACETS(m, w) w
#define SQUEEZED_FACETS(m, h) h
#endif

static inline struct principled principled_at(const Scene *scene, ireal index, const Surface *surface) {
    struct principled m;
    real3 color = COLOR(principled);
    real metallic = PARAMETER(principled, metallic), dielectric = 1.0f - metallic;
    m.roughness = PARAMETER(principled, roughness);
    m.ior = PARAMETER(principled, ior);
#if PRINCIPLED_TINT || PRINCIPLED_SHEEN
    real bright = luminance(color);
    real3 tint = choose(bright > 0.0f, scale(color, 1.0f / bright), splat(ONE));
#endif

    m.body = scale(color, dielectric);
    m.f0 = scale(color, metallic);
    m.grazing = metallic;
    m.dielectric = dielectric;
#if PRINCIPLED_TINT
    real tinted = dielectric * PARAMETER(principled, spec_tint);
    m.f0 = mad3(tint, tinted * square((m.ior - 1.0f) / (m.ior + 1.0f)), m.f0);
    m.grazing += tinted;
    m.dielectric -= tinted;
#endif

    real alpha = m.roughness * m.roughness, least = (real)(PRINCIPLED_ALPHA_MIN);
    m.alpha = maximum(alpha, least);
#if PRINCIPLED_ANISOTROPY
    real aspect = sqrt(1.0f - 0.9f * PARAMETER(principled, anisotropic));
    real along = maximum(alpha / aspect, least), across = maximum(alpha * aspect, least);
    m.alpha = sqrt(along * across);
    m.brush = brush_at(surface, along, across);
#endif
#if PRINCIPLED_SHEEN
    real3 sheen_color = mad3(sub(tint, splat(ONE)), PARAMETER(principled, sheen_tint), splat(ONE));
    m.sheen = scale(sheen_color, dielectric * PARAMETER(principled, sheen));
#endif
#if PRINCIPLED_FLATNESS
    m.flatness = PARAMETER(principled, flatness);
#endif
#if PRINCIPLED_CLEARCOAT
    m.coat = 0.25f * PARAMETER(principled, clearcoat);
    m.coat_alpha = 0.1f - 0.099f * PARAMETER(principled, clearcoat_gloss);
#endif

#if PRINCIPLED_TRANSMISSION
    real through = PARAMETER(principled, spec_trans);
    m.body = scale(m.body, 1.0f - through);
    m.passing = scale(vector(sqrt(color.x), sqrt(color.y), sqrt(color.z)), dielectric * through);
    ireal inside = (PARAMETER(principled, transmits) > 0.0f) & !surface->front;
    m.ior = inside ? 1.0f / m.ior : m.ior;
    m.body = choose(inside, splat(ZERO), m.body);
    m.f0 = choose(inside, splat(ZERO), m.f0);
    m.grazing = inside ? ZERO : m.grazing;
    m.dielectric = inside ? dielectric * through : m.dielectric;
#if PRINCIPLED_SHEEN
    m.sheen = choose(inside, splat(ZERO), m.sheen);
#endif
#if PRINCIPLED_CLEARCOAT
    m.coat = inside ? ZERO : m.coat;
#endif
#endif
    // As in Mitsuba, even metal does not reflect where nothing is refracted.
    ireal matched = m.ior == 1.0f;
    m.f0 = choose(matched, splat(ZERO), m.f0);
    m.grazing = matched ? ZERO : m.grazing;
    m.dielectric = matched ? ZERO : m.dielectric;
    return m;
}

static inline real schlick_weight(real cosine) {
    real c = minimum(maximum(1.0f - cosine, ZERO), ONE), c2 = c * c;
    return c2 * c2 * c;
}

// What a microfacet reflects: F; the dielectric's Fresnel term and cosine of refraction; the Schlick weight, by the cosine
// on the less dense side.
typedef struct { real3 f; real dielectric, cos_t, weight; } Facet;

static inline Facet facet_at(const struct principled *m, real cosine) {
    Facet at;
    at.dielectric = fresnel_dielectric(cosine, m->ior, &at.cos_t);
    at.weight = schlick_weight(m->ior > 1.0f ? cosine : at.cos_t);
    at.f = mad3(m->f0, 1.0f - at.weight, splat(m->dielectric * at.dielectric + m->grazing * at.weight));
    return at;
}

// The fraction of the samples of a microfacet that are reflected.
static inline real reflected_share(const struct principled *m, const Facet *at) {
#if PRINCIPLED_TRANSMISSION
    real back = luminance(at->f), on = luminance(m->passing) * (1.0f - at->dielectric);
    return back + on > 0.0f ? back / (back + on) : ONE;
#else
    return ONE;
#endif
}

#if PRINCIPLED_CLEARCOAT
// Burley's GTR1: a distribution with a longer tail than GGX.
static inline real gtr1_d(real3 h, real alpha) {
    real a2 = alpha * alpha;
    return (a2 - 1.0f) / (2.0f * PI * log(alpha) * (h.x * h.x + h.y * h.y + a2 * h.z * h.z));
}

// Sample D·cos h: 1 − z² = (alpha^(2(1 − u)) − alpha²)/(1 − alpha²).
static inline real3 sample_gtr1(real alpha, real2 u) {
    real s, c, a2 = alpha * alpha, logarithm = 2.0f * log(alpha), inverse = 1.0f / (1.0f - a2);
    sincos_turns(u.x, &s, &c);
    real radius = sqrt(a2 * expm1(-u.y * logarithm) * inverse);
    real z = sqrt(maximum(-expm1((1.0f - u.y) * logarithm) * inverse, (real)(1e-30f)));
    return vector(radius * c, radius * s, z);
}

// At normal incidence, within 3e-4.
static inline real gtr1_albedo(const struct principled *m) { return m->coat * (0.144f - 0.13f * sqrt(m->coat_alpha)); }

// f·cos wi of the clearcoat, without D.
static inline real coat_reflectance(const struct principled *m, real3 wo, real3 wi, real weight) {
    real f = COAT_F0 + (1.0f - COAT_F0) * weight;
    real masking = (1.0f + ggx_lambda(wo, (real)(COAT_SHADOWING))) * (1.0f + ggx_lambda(wi, (real)(COAT_SHADOWING)));
    return m->coat * f * wi.z / masking;
}
#endif

// Fractions of samples given to the lobes, by estimates of their albedos.
typedef struct { real diffuse, coat, facets; } PrincipledShares;

static inline PrincipledShares principled_shares(const struct principled *m, real3 wo) {
    Facet flat = facet_at(m, wo.z);
    PrincipledShares shares = {luminance(m->body), ZERO, luminance(flat.f)};
#if PRINCIPLED_TRANSMISSION
    shares.facets += luminance(m->passing) * (1.0f - flat.dielectric);
#endif
#if PRINCIPLED_SHEEN
    shares.diffuse += luminance(m->sheen) * (SHEEN_LOW + SHEEN_HIGH * square(1.0f - wo.z));
#endif
#if PRINCIPLED_CLEARCOAT
    shares.coat = gtr1_albedo(m) * wo.z;
#endif
    real sum = shares.diffuse + shares.coat + shares.facets, inverse = sum > 0.0f ? 1.0f / sum : ZERO;
    shares.diffuse *= inverse;
    shares.coat *= inverse;
    shares.facets = sum > 0.0f ? shares.facets * inverse : ONE;
    return shares;
}

// f·cos wi of the diffuse lobe and the sheen; cos_d: wi·h.
static inline real3 principled_matte(const struct principled *m, real3 wo, real3 wi, real cos_d) {
    real o = schlick_weight(wo.z), i = schlick_weight(wi.z), retro = 2.0f * m->roughness * cos_d * cos_d;
    real lobe = (1.0f - 0.5f * o) * (1.0f - 0.5f * i) + retro * (o + i + o * i * (retro - 1.0f));
#if PRINCIPLED_FLATNESS
    real grazing = 0.5f * retro - 1.0f;
    real flat = (1.0f + o * grazing) * (1.0f + i * grazing);
    flat = 1.25f * (flat * (1.0f / (wo.z + wi.z) - 0.5f) + 0.5f);
    lobe += m->flatness * (flat - lobe);
#endif
    real3 sum = scale(m->body, lobe * (1.0f / PI));
#if PRINCIPLED_SHEEN
    sum = mad3(m->sheen, schlick_weight(cos_d), sum);
#endif
    return scale(sum, wi.z);
}

// D·G1(wo)/cos wo of visible normals h.
static inline real visible_facets(const struct principled *m, real3 wo, real3 h) {
    real lambda = ggx_lambda(STRETCHED_FACETS(m, wo), m->alpha);
    return ggx_d(SQUEEZED_FACETS(m, h), m->alpha) / (wo.z * (1.0f + lambda));
}

static inline real facet_masking(const struct principled *m, real3 wi) {
    return 1.0f / (1.0f + ggx_lambda(STRETCHED_FACETS(m, wi), m->alpha));
}

static inline BsdfValue principled_reflection(const struct principled *m, real3 wo, real3 wi, PrincipledShares shares) {
    real3 sum = add(wo, wi);
    real length = length3(sum), cos_d = 0.5f * length;
    real3 h = scale(sum, 1.0f / length);
    Facet facet = facet_at(m, cos_d);
    real visible = 0.25f * visible_facets(m, wo, h);
    BsdfValue at;
    at.matte = principled_matte(m, wo, wi, cos_d);
    at.value = mad3(facet.f, visible * facet_masking(m, wi), at.matte);
    at.pdf = shares.facets * visible * reflected_share(m, &facet) + shares.diffuse * cosine_pdf(wi.z);
#if PRINCIPLED_CLEARCOAT
    real d = gtr1_d(h, m->coat_alpha);
    at.value = add(at.value, splat(d * coat_reflectance(m, wo, wi, facet.weight)));
    at.pdf += shares.coat * d * h.z / (4.0f * cos_d);
#endif
    return choose_value((wo.z > 0.0f) & (wi.z > 0.0f), at, no_value());
}

#if PRINCIPLED_TRANSMISSION
// Radiance on wo's side over radiance beyond the surface.
static inline real principled_spread(const struct principled *m) { return 1.0f / (m->ior * m->ior); }

static inline ireal principled_transmits(const struct principled *m) { return largest(m->passing) > 0.0f; }

// Refraction at microfacets (rough_dielectric.cl).
static inline BsdfValue principled_transmission(const struct principled *m, real3 wo, real3 wi, PrincipledShares shares) {
    real3 sum = mad3(wi, m->ior, wo);
    real length2 = dot3(sum, sum);
    real3 h = scale(sum, (sum.z < 0.0f ? (real)(-1.0f) : ONE) * rsqrt(length2));
    real cos_o = dot3(wo, h), cos_i = -dot3(wi, h);
    Facet facet = facet_at(m, cos_o);
    real visible = visible_facets(m, wo, h) * cos_o * cos_i * m->ior * m->ior / length2;
    BsdfValue at = no_value();
    real passing = (1.0f - fresnel_of_cosines(cos_o, cos_i, m->ior)) * principled_spread(m);
    at.value = scale(m->passing, passing * visible * facet_masking(m, wi));
    at.pdf = shares.facets * visible * (1.0f - reflected_share(m, &facet));
    ireal possible = (wo.z > 0.0f) & (wi.z < 0.0f) & (cos_o > 0.0f) & (cos_i > 0.0f) & principled_transmits(m);
    return choose_value(possible, at, no_value());
}
#endif

static inline BsdfValue principled_eval(const struct principled *m, real3 wo, real3 wi) {
    PrincipledShares shares = principled_shares(m, wo);
    BsdfValue at = principled_reflection(m, wo, wi, shares);
#if PRINCIPLED_TRANSMISSION
    ireal beyond = wi.z < 0.0f;
    if (ANY(beyond)) at = choose_value(beyond, principled_transmission(m, wo, wi, shares), at);
#endif
    return at;
}

static inline BsdfSample principled_sample(const struct principled *m, real3 wo, real2 u, real lobe) {
    PrincipledShares shares = principled_shares(m, wo);
    real3 h = sample_visible_normal(STRETCHED_FACETS(m, wo), m->alpha, u);
#if PRINCIPLED_ANISOTROPY
    h = from_brush(&m->brush, normalize3(stretch(&m->brush, h)));
#endif
    ireal diffuse = lobe < shares.diffuse;
#if PRINCIPLED_CLEARCOAT
    ireal coated = !diffuse & (lobe < shares.diffuse + shares.coat);
    if (ANY(coated)) h = choose(coated, sample_gtr1(m->coat_alpha, u), h);
#endif
    real cos_o = dot3(wo, h);
    BsdfSample sample = no_sample();
    sample.wi = choose(diffuse, sample_cosine(u), sub(scale(h, 2.0f * cos_o), wo));
    ireal kept = sample.wi.z > 0.0f;
#if PRINCIPLED_TRANSMISSION
    Facet facet = facet_at(m, cos_o);
    real before = shares.diffuse + shares.coat, to_inside = 1.0f / m->ior;
    ireal refracted = (lobe >= before) & (lobe - before >= shares.facets * reflected_share(m, &facet));
    real3 through = normalize3(sub(scale(h, cos_o * to_inside - facet.cos_t), scale(wo, to_inside)));
    sample.wi = choose(refracted, through, sample.wi);
    kept = refracted ? sample.wi.z < 0.0f : kept;
    sample.spread = refracted ? principled_spread(m) : ONE;
#endif
    weigh_sample(&sample, principled_eval(m, wo, sample.wi), kept);
#if PRINCIPLED_TRANSMISSION
    sample.weight = scale(sample.weight, 1.0f / sample.spread);
#endif
    return sample;
}

// At normal incidence, of smooth microfacets, by the integrals of the diffuse lobes.
static inline real3 principled_albedo(const struct principled *m) {
    Facet facet = facet_at(m, ONE);
    real lobe = 41.0f / 42.0f + 5.0f / 84.0f * m->roughness;
#if PRINCIPLED_FLATNESS
    real flat = 1.25f * (0.5f + 0.1137056f - 0.0147709f + m->roughness / 112.0f);
    lobe += m->flatness * (flat - lobe);
#endif
    real3 sum = mad3(m->body, lobe, facet.f);
#if PRINCIPLED_TRANSMISSION
    sum = mad3(m->passing, 1.0f - facet.dielectric, sum);
#endif
#if PRINCIPLED_SHEEN
    sum = mad3(m->sheen, (real)(SHEEN_LOW), sum);
#endif
#if PRINCIPLED_CLEARCOAT
    sum = add(sum, splat(gtr1_albedo(m)));
#endif
    return vector(minimum(sum.x, ONE), minimum(sum.y, ONE), minimum(sum.z, ONE));
}
