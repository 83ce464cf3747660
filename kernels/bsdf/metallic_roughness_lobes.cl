// The lobes of metallic_roughness: values, pdfs and samples.
// The body under the couplings without albedos: f·pi. cos_h: wi·h.
static inline real3 crossing_value(const struct metallic_roughness *m, real3 wo, real3 wi, real cos_h) {
    real3 crossing = mul(transmitted(m, wi.z), transmitted(m, wo.z));
#if COUPLING_HALF_VECTOR
    crossing = choose(m->coupling == 2, transmitted(m, cos_h), crossing);
#endif
    return mul(crossing, m->albedo);
}

// The lobes of the body and of multiple scattering. matte: of the body alone; if both share a lobe, the body's part at
// wi.
static inline BsdfValue diffuse_lobes(const struct metallic_roughness *m, real3 wo, real3 wi, real cos_h) {
    real3 body = splat(ZERO);
#if OTHER_COUPLINGS
    body = crossing_value(m, wo, wi, cos_h);
#endif
    real3 both = body;
    real pdf = m->shares.diffuse * cosine_pdf(wi.z);
#if GGX_ALBEDO
    Bounce bounce_i = BOUNCE_AT(m, wi);
#endif
#if MULTIPLE_SCATTERING
    both = mad3(m->multiple, m->lost_o * bounce_i.lost, both);
    pdf += m->shares.multiple * multiple_pdf(m, wi.z);
#endif
#if COUPLING_ALBEDO
    body = choose(BY_ALBEDO(m), mul(m->left_o, BODY_LEFT(m, bounce_i, wi.z)), body);
    both = choose(BY_ALBEDO(m), mul(m->left_o, LEFT_ALBEDO(m, bounce_i, wi.z)), both);
#endif
    real cosine = wi.z * (1.0f / PI);
    return (BsdfValue){scale(both, cosine), scale(body, cosine), pdf};
}

// The lobes, scaled by the factors gloss and diffuse.
static inline BsdfValue weighed_lobes(const struct metallic_roughness *m, real3 wo, real3 wi, real gloss, real diffuse) {
    real3 sum = add(wo, wi);
    real length = length3(sum), cos_h = 0.5f * length;     // wi·h = wo·h; their dot products would differ near wi = −wo
    real facets = ggx_d(SQUEEZED(m, scale(sum, 1.0f / length)), m->alpha) / (4.0f * wo.z);
    BsdfValue at = diffuse_lobes(m, wo, wi, cos_h);
    at.matte = scale(at.matte, diffuse);
    at.value = mad3(base_fresnel(m, cos_h), gloss * facets * smith_shadowing(STRETCHED(m, wo), STRETCHED(m, wi), m->alpha, m->smith),
                    scale(at.value, diffuse));
    at.pdf += m->shares.specular * facets / (1.0f + ggx_lambda(STRETCHED(m, wo), m->alpha));
    return choose_value((wo.z > 0.0f) & (wi.z > 0.0f), at, no_value());
}

static inline BsdfValue BASE(eval)(const struct metallic_roughness *m, real3 wo, real3 wi) {
    return weighed_lobes(m, wo, wi, ONE, ONE);
}

// Albedo without the losses between microfacets, so without fits: f0, and the light that crosses the surface twice, (1
// − f0) of it in at normal incidence and (1 − f0)·20/21, the cosine-weighted mean of 1 − F, out again.
static inline real3 BASE(albedo)(const struct metallic_roughness *m) {
    real3 in = sub(splat(ONE), m->f0);
    real3 albedo = mad3(mul(mul(in, in), m->albedo), (real)(20.0f / 21.0f), m->f0);
#if COUPLING_ALBEDO
    Bounce straight = BOUNCE_AT(m, vector(ZERO, ZERO, ONE));
#if IRIDESCENCE
    real3 coupled = add(scale(base_fresnel(m, ONE), 1.0f - straight.lost), left_albedo(m, straight));
#else
    real3 coupled = add(bounce_albedo(m->f0, F90(m), straight), left_albedo(m, straight));
#endif
    albedo = choose(BY_ALBEDO(m), coupled, albedo);
#endif
    return albedo;
}

static inline BsdfSample BASE(sample)(const struct metallic_roughness *m, real3 wo, real2 u, real lobe) {
    real3 h = sample_visible_normal(STRETCHED(m, wo), m->alpha, u);
#if ANISOTROPY
    h = normalize3(STRETCHED(m, h));
#endif
    real3 reflected = sub(scale(h, 2.0f * dot3(wo, h)), wo);
    BsdfSample sample = no_sample();
    LobeShares share = m->shares;
    sample.wi = choose(lobe < share.specular, reflected, sample_cosine(u));
#if MULTIPLE_SCATTERING
    sample.wi = choose(lobe >= 1.0f - share.multiple, sample_multiple(m, u), sample.wi);
#endif
    weigh_sample(&sample, BASE(eval)(m, wo, sample.wi), ALL_LANES);
    return sample;
}
