// What may lie on a metallic_roughness surface, and what may pass through it, as glTF's extensions have them:
//   CLEARCOAT  a clear film over all, F0 = 0.04: factor `clearcoat`, GGX of its own roughness
//   SHEEN      fibres over the rest: sheen_color·D(h)·V (sheen.cl)
//   THROUGH    the part `transmission` of the body is a thin sheet, which passes light on through microfacets, not bent:
//              color·(1 − F(wo·h))·G·D/(4·cos wo·cos wi), wi mirrored to wo's side
//
// COAT_NORMALS: wo and wi are in the frame of the unbent normal. The coat, and what lies below it, each reflect in a frame around
// a normal of their own: nothing to below its horizon. Gloss that is sent below that of the unbent one is mirrored there, as at
// the geometric surface (horizon.cl).
//
// What a coat reflects by F(cos) it takes from what lies below twice, at wo and at wi, and fibres leave 1 − max(sheen_color)·E
// of the larger E of both: so all is reciprocal and no light is made. glTF takes a coat's share at wo alone. E, the fibres'
// albedo by V, exceeds 1 at grazing angles where they are smooth; there their f is divided by it at each angle.
#if COAT_NORMALS
#define IN_BASE(m, w) to_local((m)->base_frame, w)
#define IN_COAT(m, w) to_local((m)->coat_frame, w)
#define OF_COAT(m, w) to_world((m)->coat_frame, w)
#define IF_ABOVE(wo, wi, value) ((((wo).z > 0.0f) & ((wi).z > 0.0f)) ? (value) : ZERO)
#else
#define IN_BASE(m, w) (w)
#define IN_COAT(m, w) (w)
#define OF_COAT(m, w) (w)
#define IF_ABOVE(wo, wi, value) (value)
#endif

#if CLEARCOAT
static inline real coat_fresnel(const struct metallic_roughness *m, real cos_theta) {
    real c = 1.0f - minimum(absolute(cos_theta), ONE), c2 = c * c;
    return m->coat * (0.04f + 0.96f * c2 * c2 * c);
}
#endif

#if SHEEN
static inline real3 sheen_value(const struct metallic_roughness *m, real3 wo, real3 wi) {
    real d = fibres_d(&m->fibres, normalize3(add(wo, wi)).z);
    real bounds = maximum(fibres_albedo(&m->fibres, wo.z), ONE) * maximum(fibres_albedo(&m->fibres, wi.z), ONE);
    return scale(m->sheen, IF_ABOVE(wo, wi, d * wi.z / (4.0f * (wo.z + wi.z - wo.z * wi.z) * bounds)));
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
    return 1.0f - largest(m->sheen) * minimum(maximum(fibres_albedo(&m->fibres, wo.z), fibres_albedo(&m->fibres, wi.z)), ONE);
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

static inline LayerShares layer_shares(const struct metallic_roughness *m, real3 base_o, real3 coat_o) {
    LayerShares share = {ZERO, ZERO, ZERO, ONE};
    real left = ONE;
#if CLEARCOAT
    share.coat = coat_fresnel(m, coat_o.z);
    left -= share.coat;
#endif
#if SHEEN
    real albedo = minimum(fibres_albedo(&m->fibres, base_o.z), ONE);
    share.sheen = left * luminance(m->sheen) * albedo;
    left *= 1.0f - largest(m->sheen) * albedo;
#endif
    real3 f = base_fresnel(m, base_o.z);
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

#if THROUGH
static inline ireal metallic_roughness_transmits(const struct metallic_roughness *m) { return largest(m->through) > 0.0f; }
#endif

// What each lobe reflects, and what passes on.
static inline BsdfValue layers_reflected(const struct metallic_roughness *m, LayerShares share, real3 wo, real3 wi) {
    real3 base_o = IN_BASE(m, wo), base_i = IN_BASE(m, wi), coat_o = IN_COAT(m, wo), coat_i = IN_COAT(m, wi);
    real fibres = under_sheen(m, base_o, base_i), film = under_coat(m, coat_o, coat_i);
    BsdfValue at = base_eval(m, base_o, base_i);
    at.matte = scale(at.matte, fibres * film);
    at.value = scale(at.value, fibres);
    at.pdf *= share.base;
#if SHEEN
    at.value = add(at.value, sheen_value(m, base_o, base_i));
    at.pdf += IF_ABOVE(base_o, base_i, share.sheen * (0.5f / PI));
#endif
    at.value = scale(at.value, film);
#if CLEARCOAT
    real hidden, density = reflected_density(coat_o, coat_i, m->coat_alpha, &hidden);
    real coat = coat_fresnel(m, 0.5f * length3(add(wo, wi))) * density * hidden;
    at.value = add(at.value, splat(IF_ABOVE(coat_o, coat_i, coat)));
    at.pdf += IF_ABOVE(coat_o, coat_i, share.coat * density);
#endif
    return at;
}

#if THROUGH
static inline BsdfValue layers_transmitted(const struct metallic_roughness *m, LayerShares share, real3 wo, real3 wi) {
    real3 base_o = IN_BASE(m, wo), base_i = IN_BASE(m, wi), mirrored = vector(base_i.x, base_i.y, -base_i.z);
    real seen, density = reflected_density(base_o, mirrored, m->alpha, &seen);
    real3 on = mul(sub(splat(ONE), base_fresnel(m, 0.5f * length3(add(base_o, mirrored)))), m->through);
    seen *= density * under_coat(m, IN_COAT(m, wo), IN_COAT(m, wi)) * under_sheen(m, base_o, base_i);
    return (BsdfValue){scale(on, IF_ABOVE(base_o, mirrored, seen)), splat(ZERO),
                       IF_ABOVE(base_o, mirrored, share.through * density)};
}
#endif

static inline BsdfValue layers_eval(const struct metallic_roughness *m, LayerShares share, real3 wo, real3 wi) {
    BsdfValue at = layers_reflected(m, share, wo, wi);
#if COAT_NORMALS
    real3 across = vector(wi.x, wi.y, -wi.z);
    BsdfValue folded = layers_reflected(m, share, wo, across);
    at.value = add(at.value, sub(folded.value, folded.matte));
    at.pdf += folded.pdf;
#endif
    at = choose_value((wo.z > 0.0f) & (wi.z > 0.0f), at, no_value());
#if THROUGH
    BsdfValue on = layers_transmitted(m, share, wo, wi);
#if COAT_NORMALS
    folded = layers_transmitted(m, share, wo, across);
    on.value = add(on.value, folded.value);
    on.pdf += folded.pdf;
#endif
    at = choose_value((wo.z > 0.0f) & (wi.z < 0.0f), on, at);
#endif
    return at;
}

static inline BsdfValue metallic_roughness_eval(const struct metallic_roughness *m, real3 wo, real3 wi) {
    return layers_eval(m, layer_shares(m, IN_BASE(m, wo), IN_COAT(m, wo)), wo, wi);
}

static inline real3 metallic_roughness_albedo(const struct metallic_roughness *m) {
    real3 albedo = base_albedo(m), straight = vector(ZERO, ZERO, ONE);
#if THROUGH
    albedo = add(albedo, mul(sub(splat(ONE), base_fresnel(m, ONE)), m->through));
#endif
    albedo = scale(albedo, under_sheen(m, straight, straight));
#if SHEEN
    albedo = mad3(m->sheen, fibres_albedo(&m->fibres, ONE), albedo);
#endif
    albedo = scale(albedo, under_coat(m, straight, straight));
#if CLEARCOAT
    albedo = add(albedo, splat(coat_fresnel(m, ONE)));
#endif
    return albedo;
}

static inline BsdfSample metallic_roughness_sample(const struct metallic_roughness *m, real3 wo, real2 u, real lobe) {
    real3 base_o = IN_BASE(m, wo), coat_o = IN_COAT(m, wo);
    LayerShares share = layer_shares(m, base_o, coat_o);
    real below = 1.0f - share.base;
    ireal is_base = lobe >= below;
    BsdfSample sample = base_sample(m, base_o, u, is_base ? minimum((lobe - below) / share.base, BELOW_ONE) : ZERO);
    ireal through = NO_LANES;
#if THROUGH
    real3 h = sample_visible_normal(base_o, m->alpha, u);
    real3 mirrored = sub(scale(h, 2.0f * dot3(base_o, h)), base_o);
    through = !is_base & (lobe >= below - share.through);
    sample.wi = choose(through, vector(mirrored.x, mirrored.y, -mirrored.z), sample.wi);
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
    // What a lobe sends below its own horizon has failed, though another lobe may send something there.
    kept = kept & (lobe < share.coat ? reflected.z > 0.0f : own_side);
#endif
    weigh_sample(&sample, layers_eval(m, share, wo, sample.wi), kept);
    return sample;
}
