// Energy that layers transmit to the lobes below them by angle, and the further energy that min(T(wo), T(wi)) removes
// (layers.cl).
#include LAYER_ENERGY_FILE

#if CLEARCOAT
// Directional albedo of the single bounce of a coat of strength 1. What the bounce loses goes to the layers below.
static inline real coat_albedo(const struct metallic_roughness *m, real cos_theta) {
    Bounce bounce = ggx_bounce(&m->coat_bounces, maximum(cos_theta, ZERO));
    return 0.04f * bounce.by_f0 + bounce.by_f90;
}
#endif

static inline real film_strength(const struct metallic_roughness *m) {
#if CLEARCOAT
    return m->coat;
#else
    return ZERO;
#endif
}

static inline real fibres_strength(const struct metallic_roughness *m) {
#if SHEEN
    return largest(m->sheen);
#else
    return ZERO;
#endif
}

// Few surfaces of a scene have layers, so nothing is computed if no lane has any.
static inline ireal has_layers(const struct metallic_roughness *m) {
    return (film_strength(m) > 0.0f) | (fibres_strength(m) > 0.0f);
}

#if LAYER_ENERGY
static inline void take(const struct metallic_roughness *m, LayerEntry entry, Left *left) {
    real film = film_strength(m), fibres = fibres_strength(m), both = film * fibres;
    left->taken_f0 = maximum(film * entry.part[0] + fibres * entry.part[2] - both * entry.part[4], ZERO);
    left->taken_f90 = maximum(film * entry.part[1] + fibres * entry.part[3] - both * entry.part[5], ZERO);
    left->taken_fibres = film * entry.part[6];
#if ANISOTROPY
    // The tables are those of isotropic surfaces: what min removes from anisotropic gloss is lost.
    ireal lost = is_anisotropic(&m->anisotropy);
    left->taken_f0 = lost ? ZERO : left->taken_f0;
    left->taken_f90 = lost ? ZERO : left->taken_f90;
#endif
}
#endif

static inline Left left_at(const struct metallic_roughness *m, real base_cos, real coat_cos) {
    Left left = {ONE, ONE, ZERO, ZERO, ZERO, ZERO};
#if LAYER_ENERGY
    if (!ANY(has_layers(m))) return left;
    LayerEntry entry = entry_at(m, layer_place(base_cos));
    take(m, entry, &left);
#if CLEARCOAT
    if (ANY(m->coat > 0.0f)) left.film -= m->coat * coat_albedo(m, coat_cos);
#endif
#if SHEEN
    left.fibres = entry.part[7] * minimum(fibres_albedo(&m->fibres, base_cos), ONE);
#endif
    left.body = left.film * (1.0f - fibres_strength(m) * left.fibres);
#endif
    return left;
}

// The total energy that min(T(wo), T(wi)) removes beyond 1 − T.
static inline real3 taken(const struct metallic_roughness *m, Left left) {
    real3 all = mad3(m->f0, left.taken_f0, splat(F90(m) * left.taken_f90));
#if THROUGH
    real3 passed = mad3(sub(splat(ONE), m->body_f0), left.taken_f0, splat((1.0f - m->body_f90) * left.taken_f90));
    all = add(all, mul(passed, m->through));
#endif
#if SHEEN
    all = mad3(m->sheen, left.taken_fibres, all);
#endif
    return all;
}

#define SCATTERS (THROUGH && MULTIPLE_SCATTERING)

// Hemispherical means of the diffuse lobes; `other`: of a Lambertian lobe, independent of its albedo.
typedef struct {
#if COUPLING_ALBEDO
    real3 left;
#endif
#if SCATTERS
    real lost;
#endif
#if DIFFUSE_THROUGH
    real3 entering;
#endif
    real other;
} Means;

#if LAYER_ENERGY
// Add the effect of layers to the means without layers: mean f·(T − 1) for each f, and for `left` also what min
// removes.
static inline void add_layers(const struct metallic_roughness *m, Means *mean) {
    real film = film_strength(m), fibres = fibres_strength(m), both = film * fibres, less[4];
    LayerEntry single = entry_at(m, LAYER_PRODUCTS), product = entry_at(m, LAYER_PRODUCTS + 1.0f);
    for (int of = 0; of < 4; ++of) {
        less[of] = both * product.part[of] - film * single.part[of] - fibres * single.part[4 + of];
    }
    mean->other += less[0];
#if COUPLING_ALBEDO
    Left left;
    take(m, entry_at(m, LAYER_MEAN), &left);
    Bounce bounce = {less[1], less[2], less[3]};
    real3 body = mul(m->albedo, sub(splat(less[0]), bounce_albedo(m->body_f0, m->body_f90, bounce)));
#if MULTIPLE_SCATTERING
    body = mad3(m->multiple, bounce.lost, body);
#endif
    mean->left = add(mean->left, add(taken(m, left), body));
#endif
#if SCATTERS
    mean->lost += less[3];
#endif
#if DIFFUSE_THROUGH
    Bounce removed = {less[1], less[2], less[3]};
    mean->entering = add(mean->entering, sub(splat(less[0]), bounce_albedo(m->body_f0, m->body_f90, removed)));
#endif
}
#endif
