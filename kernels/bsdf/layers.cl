// What may lie on a metallic_roughness surface, and what may pass through it, as glTF's extensions have them:
//   CLEARCOAT  a clear film over all, F0 = 0.04: factor `clearcoat`, GGX of its own roughness
//   SHEEN      fibres over the rest: sheen_color·D(h)·V (scene/sheen.py), with n = sheen_power
//   THROUGH    the part `transmission` of the body is a thin sheet, which passes light on through microfacets, not bent:
//              color·(1 − F(wo·h))·G·D/(4·cos wo·cos wi), wi mirrored to wo's side
//
// What a coat reflects by F(cos) it takes from what lies below twice, at wo and at wi, and fibres leave 1 − max(sheen_color)·E
// of the larger E of both: so all is reciprocal and no light is made. glTF takes a coat's share at wo alone. E, the fibres'
// albedo by V, exceeds 1 at grazing angles where they are smooth; there their f is divided by it at each angle.
#if CLEARCOAT
static inline real coat_fresnel(const struct metallic_roughness *m, real cos_theta) {
    real c = 1.0f - minimum(absolute(cos_theta), ONE), c2 = c * c;
    return m->coat * (0.04f + 0.96f * c2 * c2 * c);
}
#endif

#if SHEEN
static inline real sheen_albedo(const struct metallic_roughness *m, real cos_theta) {
    real x = 2.0f * sqrt(minimum(absolute(cos_theta), ONE)) - 1.0f, sum = ZERO;
    for (int k = SHEEN_COEFFICIENTS - 1; k >= 0; --k) sum = sum * x + m->sheen_albedo[k];
    return maximum(sum, ZERO);
}

static inline real3 sheen_value(const struct metallic_roughness *m, real3 wo, real3 wi) {
    real z = normalize3(add(wo, wi)).z, n = m->sheen_power;
    real d = (2.0f + n) * (0.5f / PI) * exp(0.5f * n * log(maximum(1.0f - z * z, (real)(1e-30f))));
    real bounds = maximum(sheen_albedo(m, wo.z), ONE) * maximum(sheen_albedo(m, wi.z), ONE);
    return scale(m->sheen, d * wi.z / (4.0f * (wo.z + wi.z - wo.z * wi.z) * bounds));
}
#endif

// What the layers above leave to the fibres and the body, and to the body alone.
static inline real under_coat(const struct metallic_roughness *m, real3 wo, real3 wi) {
#if CLEARCOAT
    return (1.0f - coat_fresnel(m, wo.z)) * (1.0f - coat_fresnel(m, wi.z));
#else
    return ONE;
#endif
}

static inline real under_sheen(const struct metallic_roughness *m, real3 wo, real3 wi) {
#if SHEEN
    return 1.0f - largest(m->sheen) * minimum(maximum(sheen_albedo(m, wo.z), sheen_albedo(m, wi.z)), ONE);
#else
    return ONE;
#endif
}

// G1·D/(4·cos wo), the density of reflecting by a normal visible from wo; *hidden: G2/G1.
static inline real reflected_density(real3 wo, real3 wi, real alpha, real *hidden) {
    real lambda_o = ggx_lambda(wo, alpha);
    *hidden = (1.0f + lambda_o) / (1.0f + lambda_o + ggx_lambda(wi, alpha));
    return ggx_d(normalize3(add(wo, wi)), alpha) / (4.0f * wo.z * (1.0f + lambda_o));
}

// The probabilities of the lobes: about their shares of the light that leaves.
typedef struct { real coat, sheen, through, base; } LayerShares;

static inline LayerShares layer_shares(const struct metallic_roughness *m, real3 wo) {
    LayerShares share = {ZERO, ZERO, ZERO, ONE};
    real left = ONE;
#if CLEARCOAT
    share.coat = coat_fresnel(m, wo.z);
    left -= share.coat;
#endif
#if SHEEN
    real albedo = minimum(sheen_albedo(m, wo.z), ONE);
    share.sheen = left * luminance(m->sheen) * albedo;
    left *= 1.0f - largest(m->sheen) * albedo;
#endif
    real3 f = base_fresnel(m, wo.z);
    share.base = left * (luminance(f) + luminance(mul(sub(splat(ONE), f), m->albedo)));
#if THROUGH
    share.through = left * luminance(mul(sub(splat(ONE), f), m->through));
#endif
    real sum = share.coat + share.sheen + share.through + share.base;
    ireal some = sum > 0.0f;
    real inverse = some ? 1.0f / sum : ZERO;
    return (LayerShares){share.coat * inverse, share.sheen * inverse, share.through * inverse,
                         some ? share.base * inverse : ONE};
}

static inline real3 metallic_roughness_eval(const struct metallic_roughness *m, real3 wo, real3 wi) {
    real3 value = scale(base_eval(m, wo, wi), under_sheen(m, wo, wi));
#if SHEEN
    value = add(value, sheen_value(m, wo, wi));
#endif
    value = scale(value, under_coat(m, wo, wi));
#if CLEARCOAT
    real hidden;
    real coat = reflected_density(wo, wi, m->coat_alpha, &hidden) * hidden;
    value = add(value, splat(coat_fresnel(m, 0.5f * length3(add(wo, wi))) * coat));
#endif
    value = choose((wo.z > 0.0f) & (wi.z > 0.0f), value, splat(ZERO));
#if THROUGH
    real3 mirrored = vector(wi.x, wi.y, -wi.z);
    real seen;
    real density = reflected_density(wo, mirrored, m->alpha, &seen) * seen;
    real3 on = mul(sub(splat(ONE), base_fresnel(m, 0.5f * length3(add(wo, mirrored)))), m->through);
    on = scale(on, density * under_coat(m, wo, wi) * under_sheen(m, wo, wi));
    value = choose((wo.z > 0.0f) & (wi.z < 0.0f), on, value);
#endif
    return value;
}

static inline real metallic_roughness_pdf(const struct metallic_roughness *m, real3 wo, real3 wi) {
    LayerShares share = layer_shares(m, wo);
    real hidden, pdf = share.base * base_pdf(m, wo, wi);
#if CLEARCOAT
    pdf += share.coat * reflected_density(wo, wi, m->coat_alpha, &hidden);
#endif
#if SHEEN
    pdf += share.sheen * (0.5f / PI);
#endif
    pdf = ((wo.z > 0.0f) & (wi.z > 0.0f)) ? pdf : ZERO;
#if THROUGH
    real on = share.through * reflected_density(wo, vector(wi.x, wi.y, -wi.z), m->alpha, &hidden);
    pdf = ((wo.z > 0.0f) & (wi.z < 0.0f)) ? on : pdf;
#endif
    return pdf;
}

static inline real3 metallic_roughness_albedo(const struct metallic_roughness *m) {
    real3 albedo = base_albedo(m), straight = vector(ZERO, ZERO, ONE);
#if THROUGH
    albedo = add(albedo, mul(sub(splat(ONE), base_fresnel(m, ONE)), m->through));
#endif
    albedo = scale(albedo, under_sheen(m, straight, straight));
#if SHEEN
    albedo = mad3(m->sheen, sheen_albedo(m, ONE), albedo);
#endif
    albedo = scale(albedo, under_coat(m, straight, straight));
#if CLEARCOAT
    albedo = add(albedo, splat(coat_fresnel(m, ONE)));
#endif
    return albedo;
}

static inline BsdfSample metallic_roughness_sample(const struct metallic_roughness *m, real3 wo, real2 u, real lobe) {
    LayerShares share = layer_shares(m, wo);
    real below = 1.0f - share.base;
    ireal is_base = lobe >= below;
    BsdfSample sample = base_sample(m, wo, u, is_base ? minimum((lobe - below) / share.base, BELOW_ONE) : ZERO);
    ireal through = NO_LANES;
#if THROUGH
    real3 h = sample_visible_normal(wo, m->alpha, u);
    real3 mirrored = sub(scale(h, 2.0f * dot3(wo, h)), wo);
    through = !is_base & (lobe >= below - share.through);
    sample.wi = choose(through, vector(mirrored.x, mirrored.y, -mirrored.z), sample.wi);
#endif
#if SHEEN
    real sine, cosine, r = safe_sqrt(1.0f - u.x * u.x);
    sincos_turns(u.y, &sine, &cosine);
    sample.wi = choose(lobe < share.coat + share.sheen, vector(r * cosine, r * sine, u.x), sample.wi);
#endif
#if CLEARCOAT
    real3 film = sample_visible_normal(wo, m->coat_alpha, u);
    sample.wi = choose(lobe < share.coat, sub(scale(film, 2.0f * dot3(wo, film)), wo), sample.wi);
#endif
    real pdf = metallic_roughness_pdf(m, wo, sample.wi);
    sample.pdf = (through ? sample.wi.z < 0.0f : sample.wi.z > 0.0f) ? pdf : ZERO;
    real inverse = sample.pdf > 0.0f ? 1.0f / sample.pdf : ZERO;
    sample.weight = scale(metallic_roughness_eval(m, wo, sample.wi), inverse);
    return sample;
}
