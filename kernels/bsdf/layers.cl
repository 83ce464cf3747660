// Layers on a metallic_roughness surface, and transmission through it, following glTF's extensions:
//   CLEARCOAT  a clear coat on top, F0 = 0.04: factor `clearcoat`, GGX with its own roughness
//   SHEEN      fibres over the rest: sheen_color·D(h)·V (sheen.cl)
//   DIFFUSE_THROUGH  the fraction `diffuse_transmission` of the rest of the body is a thin sheet that transmits like
//              Lambert, with the albedo coupling: diffuse_transmission_color·s(wo)·s(wi)/(pi·mean s), s = T·(1 − E)
//   THROUGH    the fraction `transmission` of the body is a thin sheet: microfacet transmission without refraction,
//              color·(1 − F(wo·h))·G·D/(4·cos wo·cos wi), wi mirrored to wo's side, F of the dielectric part
//
// COAT_NORMALS: wo and wi are in the frame of the unbent normal. The coat and the base each reflect in a frame around
// their own normal, and nothing below its horizon. Gloss scattered below the horizon of the unbent normal is mirrored
// at it, as at the geometric surface (surface/horizon.cl).
//
// A coat transmits T(c) = 1 − clearcoat·E(c) of light from an angle, with the albedo E of its single bounce
// (ggx_albedo.cl); the energy that bounce loses goes to the base. Fibres transmit 1 − max(sheen_color)·E, with their
// own E. With the product T of both
//   gloss, fibres, and microfacet transmission are scaled by min(T(wo), T(wi)): T of one angle if they are smooth
//   the diffuse lobe r(wo)·r(wi)/(pi·mean r) becomes R(wo)·R(wi)/(pi·mean R), R = T·r + what min removes beyond 1 − T
//   (layer_energy.cl), per channel; other diffuse lobes are scaled by T(wo)·T(wi)/mean T
// All are reciprocal, and a white material passes the white furnace test. Couplings without albedos lose what min
// removes. glTF evaluates the coat's share at wo alone. The fibres' f is divided by the larger of the albedos of wo and
// wi if that exceeds 1.
//
// Transmitted light that a single bounce loses is returned by a Kulla–Conty lobe if MULTIPLE_SCATTERING.
#if COAT_NORMALS
#define IN_BASE(m, w) to_local((m)->base_frame, w)
#define IN_COAT(m, w) to_local((m)->coat_frame, w)
#define OF_COAT(m, w) to_world((m)->coat_frame, w)
#define IF_ABOVE(wo, wi, value) ((((wo).z > 0.0f) & ((wi).z > 0.0f)) ? (value) : ZERO)
#define COAT_COS(surface) (surface)->coat_cos_o
#else
#define IN_BASE(m, w) (w)
#define IN_COAT(m, w) (w)
#define OF_COAT(m, w) (w)
#define IF_ABOVE(wo, wi, value) (value)
#define COAT_COS(surface) (surface)->cos_o
#endif

#if CLEARCOAT
static inline real coat_fresnel(const struct metallic_roughness *m, real cos_theta) {
    real c = 1.0f - minimum(absolute(cos_theta), ONE), c2 = c * c;
    return m->coat * (0.04f + 0.96f * c2 * c2 * c);
}

// G1·D/(4·cos wo), the pdf of reflection at a normal visible from wo; *hidden: G2/G1.
static inline real reflected_density(real3 wo, real3 wi, real alpha, real *hidden) {
    real lambda_o = ggx_lambda(wo, alpha);
    *hidden = (1.0f + lambda_o) / (1.0f + lambda_o + ggx_lambda(wi, alpha));
    return ggx_d(normalize3(add(wo, wi)), alpha) / (4.0f * wo.z * (1.0f + lambda_o));
}
#endif

#if SHEEN
static inline real3 sheen_value(const struct metallic_roughness *m, real3 wo, real3 wi) {
    real d = fibres_d(&m->fibres, normalize3(add(wo, wi)).z);
    real bound = maximum(maximum(fibres_albedo(&m->fibres, wo.z), fibres_albedo(&m->fibres, wi.z)), ONE);
    return scale(m->sheen, IF_ABOVE(wo, wi, d * wi.z / (4.0f * (wo.z + wi.z - wo.z * wi.z) * bound)));
}
#endif

#include "bsdf/below_layers.cl"

#if THROUGH
// Light transmitted by the microfacets in a single bounce.
static inline real3 passed_on(const struct metallic_roughness *m, real cos_h) {
#if IRIDESCENCE
    real3 plain = fresnel_to(m->film_f0, m->body_f90, cos_h);
    return mul(sub(splat(ONE), with_film(&m->thin_film, m->film_f0, plain, cos_h)), m->through);
#else
    return mul(sub(splat(ONE), fresnel_to(m->body_f0, m->body_f90, cos_h)), m->through);
#endif
}
#endif

// Compute the terms that do not depend on wi. specular_o, multiple_o, diffuse_o: albedos of the lobes at wo, without
// layers.
static inline void lay_over(struct metallic_roughness *m, const Surface *surface, real specular_o, real multiple_o,
                            real diffuse_o) {
    m->left = left_at(m, surface->cos_o, COAT_COS(surface));
    Means mean;
    mean.other = ONE;
#if COUPLING_ALBEDO
    mean.left = left_albedo(m, m->bounces.mean);
#endif
#if SCATTERS
    mean.lost = m->bounces.mean.lost;
#endif
#if DIFFUSE_THROUGH
    mean.entering = sub(splat(ONE), bounce_albedo(m->body_f0, m->body_f90, m->bounces.mean));
#endif
#if LAYER_ENERGY
    if (ANY(has_layers(m))) add_layers(m, &mean);
#endif
#if OTHER_COUPLINGS
    m->diffuse_scale = inverse_or_zero(mean.other);
#endif
#if SCATTERS
    m->scattered_scale = m->bounces.mean.lost * inverse_or_zero(mean.lost);
#endif
    real left = m->left.body, moved = ZERO;
#if COUPLING_ALBEDO
    real3 from = taken(m, m->left);
    real3 R = mad3(m->left_o, left, from);
    m->left_o = mul(R, vector(inverse_or_zero(mean.left.x), inverse_or_zero(mean.left.y), inverse_or_zero(mean.left.z)));
    moved = BY_ALBEDO(m) ? luminance(from) : ZERO;
#endif
    specular_o = maximum(left * specular_o - moved, ZERO);
    multiple_o *= left;
    diffuse_o = diffuse_o * left + moved;
    m->shares = lobe_shares(specular_o, multiple_o, diffuse_o);
    LayerShares share = {1.0f - m->left.film, ZERO, ZERO, ZERO, specular_o + multiple_o + diffuse_o};
#if SHEEN
    share.sheen = m->left.film * luminance(m->sheen) * m->left.fibres;
#endif
#if THROUGH
    share.through = left * luminance(passed_on(m, surface->cos_o));
#endif
#if SCATTERS
    share.scattered = left * luminance(m->scattered) * m->lost_o * m->bounces.mean.lost;
#endif
    real sum = share.coat + share.sheen + share.scattered + share.through + share.base;
#if DIFFUSE_THROUGH
    share.diffuse = left * luminance(mul(m->diffuse_through, m->diffuse_o));
    sum += share.diffuse;
    m->diffuse_o = mul(scale(m->diffuse_o, left), vector(inverse_or_zero(mean.entering.x), inverse_or_zero(mean.entering.y), inverse_or_zero(mean.entering.z)));
#endif
    ireal some = sum > 0.0f;
    real inverse = some ? 1.0f / sum : ZERO;
    m->layers = (LayerShares){share.coat * inverse, share.sheen * inverse, share.scattered * inverse,
                              share.through * inverse, some ? share.base * inverse : ONE};
#if DIFFUSE_THROUGH
    m->layers.diffuse = share.diffuse * inverse;
#endif
}

#if DIFFUSE_THROUGH && THROUGH
static inline ireal metallic_roughness_transmits(const struct metallic_roughness *m) {
    return (largest(m->through) > 0.0f) | (largest(m->diffuse_through) > 0.0f);
}
#elif DIFFUSE_THROUGH
static inline ireal metallic_roughness_transmits(const struct metallic_roughness *m) { return largest(m->diffuse_through) > 0.0f; }
#elif THROUGH
static inline ireal metallic_roughness_transmits(const struct metallic_roughness *m) { return largest(m->through) > 0.0f; }
#endif

// Sum of the reflection lobes.
static inline BsdfValue layers_reflected(const struct metallic_roughness *m, real3 wo, real3 wi) {
    real3 base_o = IN_BASE(m, wo), base_i = IN_BASE(m, wi), coat_o = IN_COAT(m, wo), coat_i = IN_COAT(m, wi);
    Left left = left_at(m, base_i.z, coat_i.z);
    real diffuse = left.body;
#if OTHER_COUPLINGS
    diffuse *= BY_ALBEDO(m) ? ONE : m->left.body * m->diffuse_scale;
#endif
    BsdfValue at = weighed_lobes(m, base_o, base_i, minimum(m->left.body, left.body), diffuse);
#if COUPLING_ALBEDO
    real below = (BY_ALBEDO(m) & (base_o.z > 0.0f) & (base_i.z > 0.0f)) ? base_i.z * (1.0f / PI) : ZERO;
    at.value = mad3(mul(m->left_o, taken(m, left)), below, at.value);
#endif
    at.pdf *= m->layers.base;
#if SHEEN
    at.value = mad3(sheen_value(m, base_o, base_i), minimum(m->left.film, left.film), at.value);
    at.pdf += IF_ABOVE(base_o, base_i, m->layers.sheen * (0.5f / PI));
#endif
#if CLEARCOAT
    real hidden, density = reflected_density(coat_o, coat_i, m->coat_alpha, &hidden);
    real coat = coat_fresnel(m, 0.5f * length3(add(wo, wi))) * density * hidden;
    at.value = add(at.value, splat(IF_ABOVE(coat_o, coat_i, coat)));
    at.pdf += IF_ABOVE(coat_o, coat_i, m->layers.coat * density);
#endif
    return at;
}

#if THROUGH || DIFFUSE_THROUGH
static inline BsdfValue layers_transmitted(const struct metallic_roughness *m, real3 wo, real3 wi) {
    real3 base_o = IN_BASE(m, wo), base_i = IN_BASE(m, wi), mirrored = vector(base_i.x, base_i.y, -base_i.z);
#if THROUGH
    real3 sum = add(base_o, mirrored);
    real facets = ggx_d(SQUEEZED(m, normalize3(sum)), m->alpha) / (4.0f * base_o.z);
    real3 on = passed_on(m, 0.5f * length3(sum));
#endif
    Left left = left_at(m, mirrored.z, -IN_COAT(m, wi).z);
#if THROUGH
    real seen = facets * smith_shadowing(STRETCHED(m, base_o), STRETCHED(m, mirrored), m->alpha, m->smith);
    real3 value = scale(on, seen * minimum(m->left.body, left.body));
    real pdf = m->layers.through * facets / (1.0f + ggx_lambda(STRETCHED(m, base_o), m->alpha));
#if SCATTERS
    real lost = m->lost_o * BOUNCE_AT(m, mirrored).lost * mirrored.z * (1.0f / PI);
    value = mad3(m->scattered, lost * m->left.body * left.body * m->scattered_scale, value);
    pdf += m->layers.scattered * multiple_pdf(m, mirrored.z);
#endif
#else
    real3 value = splat(ZERO);
    real pdf = ZERO;
#endif
#if DIFFUSE_THROUGH
    real3 enters = entering(m, BOUNCE_AT(m, mirrored), mirrored.z);
    value = mad3(mul(m->diffuse_through, mul(m->diffuse_o, enters)), left.body * mirrored.z * (1.0f / PI), value);
    pdf += m->layers.diffuse * cosine_pdf(mirrored.z);
#endif
    ireal above = (base_o.z > 0.0f) & (mirrored.z > 0.0f);
    return choose_value(above, (BsdfValue){value, splat(ZERO), pdf}, no_value());
}
#endif

static inline BsdfValue layers_eval(const struct metallic_roughness *m, real3 wo, real3 wi) {
    BsdfValue at = layers_reflected(m, wo, wi);
#if COAT_NORMALS
    real3 across = vector(wi.x, wi.y, -wi.z);
    BsdfValue folded = layers_reflected(m, wo, across);
    at.value = add(at.value, sub(folded.value, folded.matte));
    at.pdf += folded.pdf;
#endif
    at = choose_value((wo.z > 0.0f) & (wi.z > 0.0f), at, no_value());
#if THROUGH || DIFFUSE_THROUGH
    BsdfValue on = layers_transmitted(m, wo, wi);
#if COAT_NORMALS
    folded = layers_transmitted(m, wo, across);
    on.value = add(on.value, folded.value);
    on.pdf += folded.pdf;
#endif
    at = choose_value((wo.z > 0.0f) & (wi.z < 0.0f), on, at);
#endif
    return at;
}

static inline BsdfValue metallic_roughness_eval(const struct metallic_roughness *m, real3 wo, real3 wi) {
    return layers_eval(m, wo, wi);
}

static inline real3 metallic_roughness_albedo(const struct metallic_roughness *m) {
    real3 albedo = base_albedo(m);
#if THROUGH
    albedo = add(albedo, passed_on(m, ONE));
#endif
#if DIFFUSE_THROUGH
    albedo = mad3(mul(m->diffuse_through, entering(m, BOUNCE_AT(m, vector(ZERO, ZERO, ONE)), ONE)), ONE, albedo);
#endif
    Left left = left_at(m, ONE, ONE);
    albedo = scale(albedo, left.body);
#if SHEEN
    albedo = mad3(m->sheen, left.film * left.fibres, albedo);
#endif
    albedo = add(albedo, splat(1.0f - left.film));
    return albedo;
}

static inline BsdfSample metallic_roughness_sample(const struct metallic_roughness *m, real3 wo, real2 u, real lobe) {
    real3 base_o = IN_BASE(m, wo), coat_o = IN_COAT(m, wo);
    LayerShares share = m->layers;
    real below = 1.0f - share.base;
    ireal is_base = lobe >= below;
    BsdfSample sample = base_sample(m, base_o, u, is_base ? minimum((lobe - below) / share.base, BELOW_ONE) : ZERO);
    ireal through = NO_LANES;
#if THROUGH
    real3 h = sample_visible_normal(STRETCHED(m, base_o), m->alpha, u);
#if ANISOTROPY
    h = normalize3(STRETCHED(m, h));
#endif
    real3 mirrored = sub(scale(h, 2.0f * dot3(base_o, h)), base_o);
    through = !is_base & (lobe >= below - share.through);
#if SCATTERS
    ireal scattered = !is_base & !through & (lobe >= share.coat + share.sheen);
    mirrored = choose(scattered, sample_multiple(m, u), mirrored);
    through = through | scattered;
#endif
    sample.wi = choose(through, vector(mirrored.x, mirrored.y, -mirrored.z), sample.wi);
#endif
#if DIFFUSE_THROUGH
    real before = share.coat + share.sheen + share.scattered;
    ireal diffuse = !is_base & (lobe >= before) & (lobe < before + share.diffuse);
    real3 down = sample_cosine(u);
    sample.wi = choose(diffuse, vector(down.x, down.y, -down.z), sample.wi);
    through = through | diffuse;
#endif
#if SHEEN
    real sine, cosine, r = safe_sqrt(1.0f - u.x * u.x);
    sincos_turns(u.y, &sine, &cosine);
    sample.wi = choose(lobe < share.coat + share.sheen, vector(r * cosine, r * sine, u.x), sample.wi);
#endif
#if COAT_NORMALS
    ireal own_side = through ? sample.wi.z < 0.0f : sample.wi.z > 0.0f;
    sample.wi = to_world(m->base_frame, sample.wi);
#endif
#if CLEARCOAT
    real3 film = sample_visible_normal(coat_o, m->coat_alpha, u);
    real3 reflected = sub(scale(film, 2.0f * dot3(coat_o, film)), coat_o);
    sample.wi = choose(lobe < share.coat, OF_COAT(m, reflected), sample.wi);
#endif
#if COAT_NORMALS
    sample.wi.z = (through ? sample.wi.z > 0.0f : sample.wi.z < 0.0f) ? -sample.wi.z : sample.wi.z;
#endif
    ireal kept = through ? sample.wi.z < 0.0f : sample.wi.z > 0.0f;
#if COAT_NORMALS
    // A sample below its own lobe's horizon fails, even if another lobe could scatter there.
    kept = kept & (lobe < share.coat ? reflected.z > 0.0f : own_side);
#endif
    weigh_sample(&sample, layers_eval(m, wo, sample.wi), kept);
    return sample;
}
