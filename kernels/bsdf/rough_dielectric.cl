// Rough glass: Fresnel's and Snell's laws at microfacets, sampled by visible normals (Walter et al. 2007, eq. 20 and
// 21, with the height-correlated G2 for both sides). Local frame; beyond the surface wi.z < 0.
//
// Single bounce: light that hits a second microfacet is lost. DIELECTRIC_ENERGY compensates for that
// (dielectric_energy.cl).
// SEPARABLE_DIELECTRIC: with the separable G2. BECKMANN_DIELECTRIC: with Beckmann's distribution, sampled like GGX.
#include "bsdf/ggx.cl"
#include BECKMANN_FILE
#include DIELECTRIC_ENERGY_FILE

#if SEPARABLE_DIELECTRIC
#define SEPARABLE_GLASS(m) ((m)->separable)
#else
#define SEPARABLE_GLASS(m) NO_LANES
#endif

// The pdf with which microfacets reflect, or transmit, light to wi, which may be on the wrong side of the surface. *d:
// the Fresnel split there.
static inline real scattered_pdf(const struct dielectric *m, real3 wo, real3 wi, ireal reflected, Division *d) {
    ireal mirrored = reflected | IS_THIN(m);
    real3 sum = choose(mirrored, add(wo, vector(wi.x, wi.y, reflected ? wi.z : -wi.z)), mad3(wi, m->eta, wo));
    real length2 = dot3(sum, sum), length = sqrt(length2);
    real3 h = scale(sum, (sum.z < 0.0f ? (real)(-1.0f) : ONE) / length);
    real cos_o = mirrored ? 0.5f * length : dot3(wo, h), cos_i = dot3(wi, h), cos_t;
    real f = fresnel_dielectric(cos_o, m->eta, &cos_t);
    *d = divide_light(m, mirrored ? f : fresnel_of_cosines(cos_o, -cos_i, m->eta));
#if BECKMANN_DIELECTRIC
    d->facet = h;
#endif
    // Change of variables from visible normals: dωi = 4·cos_o dωh, or |wo + eta·wi|²/(eta²·|cos_i|) dωh for refraction.
    real visible = ggx_d(h, m->alpha) / (wo.z * (1.0f + ggx_lambda(wo, m->alpha)));
    real turned = mirrored ? (real)(0.25f) : cos_o * m->eta * m->eta * absolute(cos_i) / length2;
    real pdf = visible * turned * (reflected ? d->reflected : 1.0f - d->reflected);
    ireal possible = (m->alpha > 0.0f) & (wo.z > 0.0f) & (cos_o > 0.0f) & (mirrored ? sum.z > 0.0f : cos_i < 0.0f);
    return possible ? pdf : ZERO;
}

// The pdf of wi, on either side of the surface; *value: f·|cos|, without the spread.
static inline real rough_dielectric(const struct dielectric *m, real3 wo, real3 wi, real3 *value) {
    *value = splat(ZERO);
    if (!ANY(m->alpha > 0.0f)) return ZERO;
    ireal reflected = wi.z > 0.0f;
    Division d;
    real pdf = scattered_pdf(m, wo, wi, reflected, &d);
    real lambda_o = ggx_lambda(wo, m->alpha), lambda_i = ggx_lambda(wi, m->alpha);
    real seen = pdf * (1.0f + lambda_o) / (1.0f + lambda_o + lambda_i);
#if SEPARABLE_DIELECTRIC
    seen = m->separable ? pdf / (1.0f + lambda_i) : seen;
#endif
#if BECKMANN_DIELECTRIC
    real facets = beckmann_d(d.facet, m->alpha) / ggx_d(d.facet, m->alpha);
    real masking = beckmann_masking(wo, wi, m->alpha, SEPARABLE_GLASS(m));
    seen = m->beckmann ? pdf * (1.0f + lambda_o) * facets * masking : seen;
#endif
    *value = choose(pdf > 0.0f, scale(choose(reflected, d.reflection, d.transmission), seen), splat(ZERO));
#if DIELECTRIC_ENERGY
    ireal folds = keeps_light(m);
    if (ANY(folds)) pdf += folds ? scattered_pdf(m, wo, vector(wi.x, wi.y, -wi.z), reflected, &d) : ZERO;
    pdf = all_bounces(m, wo, wi, pdf, value);
#endif
    return pdf;
}

static inline ireal dielectric_transmits(const struct dielectric *m) { return m->alpha > 0.0f; }

static inline BsdfValue dielectric_eval(const struct dielectric *m, real3 wo, real3 wi) {
    BsdfValue at = no_value();
    at.pdf = rough_dielectric(m, wo, wi, &at.value);
    at.value = scale(at.value, wi.z > 0.0f ? ONE : dielectric_spread(m));
    return at;
}

static inline BsdfSample rough_dielectric_sample(const struct dielectric *m, real3 wo, real2 u, real lobe) {
    real3 h = sample_visible_normal(wo, maximum(m->alpha, (real)(ALPHA_MIN)), u);
#if DIELECTRIC_ENERGY
    real chance = later_chance(m, lost_from(m, m->inside, wo.z));
    ireal later = lobe < chance, returns = lobe < chance * m->returned;
    lobe = minimum((lobe - chance) / (1.0f - chance), BELOW_ONE);
#endif
    real cos_t, cos_o = dot3(wo, h);
    Division d = divide_light(m, fresnel_dielectric(cos_o, m->eta, &cos_t));
    ireal reflected = lobe < d.reflected;
    real3 mirrored = sub(scale(h, 2.0f * cos_o), wo);
    real to_inside = 1.0f / m->eta;
    real3 refracted = normalize3(sub(scale(h, cos_o * to_inside - cos_t), scale(wo, to_inside)));
    real3 straight = vector(mirrored.x, mirrored.y, -mirrored.z);
    BsdfSample sample = no_sample();
    sample.wi = choose(reflected, mirrored, choose(IS_THIN(m), straight, refracted));
#if DIELECTRIC_ENERGY
    sample.wi = choose(later, sample_later(m, u), sample.wi);
    reflected = later ? returns : reflected;
    real folded = reflected ? absolute(sample.wi.z) : -absolute(sample.wi.z);
    sample.wi.z = (later | keeps_light(m)) ? folded : sample.wi.z;
#endif
    ireal kept = reflected ? sample.wi.z > 0.0f : sample.wi.z < 0.0f;
    real3 value;
    real pdf = rough_dielectric(m, wo, sample.wi, &value);
    sample.pdf = kept ? pdf : ZERO;
    sample.weight = choose(sample.pdf > 0.0f, scale(value, 1.0f / pdf), splat(ZERO));
    sample.spread = reflected ? ONE : dielectric_spread(m);
    return sample;
}
