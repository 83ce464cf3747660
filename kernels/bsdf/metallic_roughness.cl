// Cook–Torrance microfacet reflection over a diffuse body (Suchiński 6.5–6.15, Nadolny 3.5–3.13):
//   f = F(wi·h)·G·D/(4·cos wi·cos wo) + coupling·albedo/pi,  F(c) = f0 + (f90 − f0)(1 − c)^5, h the half vector
// The coupling is the energy that the glossy lobe leaves to the body:
//   COUPLING_ALBEDO       (1 − E(wi))(1 − E(wo))/(1 − mean E), E the directional albedo of the dielectric's gloss
//                         (ggx_albedo.cl): reciprocal, and white stays white (Kelemen and Szirmay-Kalos 2001)
//   COUPLING_FRESNEL      (1 − F(cos wi))(1 − F(cos wo)): reciprocal, never more than 1 with the gloss
//   COUPLING_HALF_VECTOR  1 − F(wi·h), as in the sources and glTF, which creates energy: at roughness 0.1 white plastic
//                         reflects 1.7 times the incident light at grazing angles
//
// D is GGX, and the microfacet lobe samples normals visible from wo (ggx.cl); lobes are chosen by their albedos at wo.
//
// MULTIPLE_SCATTERING adds the reflection of further bounces between microfacets (Kulla and Conty 2017):
//   multiple·lost(cos wi)·lost(cos wo)/(pi·mean lost), multiple = mean F²·(1 − mean lost)/(1 − mean F·mean lost)
// for the metal, or for all of f0 with the couplings without albedos. lost peaks near cos ≈ alpha, at about 0.1, and
// falls with 1/cos² beyond; its own lobe is sampled with about that density. With COUPLING_ALBEDO this and the body
// form one lobe,
//   r(wi)·r(wo)/(pi·mean r), r(c) = albedo·(1 − E(c)) + multiple·lost(c)
//
// ANISOTROPY: two roughnesses along axes on the surface (anisotropy.cl).
// IRIDESCENCE: interference in a thin film changes F (iridescence.cl).
// SPECULAR: f0 of the dielectric part times specular·specular_color; F ends at `specular` (glTF's
// KHR_materials_specular).
// LAYERS: layers on top, and transmission (layers.cl).
#include "bsdf/ggx.cl"
#include "bsdf/smith.cl"
#include "bsdf/interface.cl"
#include GGX_ALBEDO_FILE
#include SHEEN_FILE
#include ANISOTROPY_FILE
#include ANISOTROPY_ALBEDO_FILE
#include IRIDESCENCE_FILE

#if ANISOTROPY
#define STRETCHED(m, w) stretched_by(&(m)->anisotropy, w)
#define SQUEEZED(m, h) squeezed_by(&(m)->anisotropy, h)
#define WIDEST_ALPHA(m) (m)->anisotropy.alpha_t
#else
#define STRETCHED(m, w) w
#define SQUEEZED(m, h) h
#define WIDEST_ALPHA(m) (m)->alpha
#endif
#if ANISOTROPY_ALBEDO
#define BOUNCE_AT(m, w) bounce_at(&(m)->anisotropy, &(m)->bounces, w)
#else
#define BOUNCE_AT(m, w) ggx_bounce(&(m)->bounces, (w).z)
#endif

#if LAYERS
#define BASE(name) base_##name
#else
#define BASE(name) metallic_roughness_##name
#endif
#define OTHER_COUPLINGS (COUPLING_FRESNEL || COUPLING_HALF_VECTOR)
// The lanes that use the albedo coupling. If no material uses another, metals may count as using it.
#if COUPLING_ALBEDO && OTHER_COUPLINGS
#define BY_ALBEDO(m) ((m)->coupling == 0)
#elif COUPLING_ALBEDO
#define BY_ALBEDO(m) ALL_LANES
#else
#define BY_ALBEDO(m) NO_LANES
#endif

// Probabilities of the lobes: their shares of the reflected light, by their albedos at wo or by the Fresnel term there.
typedef struct { real specular, multiple, diffuse; } LobeShares;

#if LAYERS
// Transmittance of the layers by direction: of the coat to all below it, and of coat and fibres to the body; the albedo
// of white fibres; and what min(T(wo), T(wi)) removes from the lobes below, beyond 1 − T (layers.cl).
typedef struct { real film, body, fibres, taken_f0, taken_f90, taken_fibres; } Left;

// Probabilities of the lobes: approximately their shares of the outgoing light.
typedef struct {
    real coat, sheen, scattered, through, base;
#if DIFFUSE_THROUGH
    real diffuse;
#endif
} LayerShares;
#endif

struct metallic_roughness {
    real3 albedo, f0;
    real alpha;
    ireal smith, coupling;
    LobeShares shares;
#if IRIDESCENCE
    ThinFilm thin_film;
    real3 film_f0;              // of the dielectric part without the film; body_f0 bounds that with it
    real3 metal_f0;
    real metallic;
#endif
#if ANISOTROPY
    Anisotropy anisotropy;      // alpha: √(alpha_t·alpha_b)
#endif
#if COUPLING_ALBEDO
    real3 left_o;               // r(wo)/mean r; below layers R(wo)/mean R
#endif
#if COUPLING_ALBEDO || THROUGH
    real3 body_f0;              // of the dielectric part
    real body_f90;
#endif
#if MULTIPLE_SCATTERING
    real3 multiple;
    real spread, lost_o;        // lost_o: divided by its mean
#endif
#if GGX_ALBEDO
    GgxAlbedo bounces;
#endif
#if SPECULAR
    real f90;
#endif
#if CLEARCOAT
    real coat, coat_alpha;
    GgxAlbedo coat_bounces;
#endif
#if LAYERS
    LayerShares layers;
    Left left;                  // at wo
#endif
#if LAYERS && OTHER_COUPLINGS
    real diffuse_scale;
#endif
#if LAYER_ENERGY
    const Scene *scene;
    ireal first_entry;
#endif
#if LAYER_ROWS
    real3 row, last_row;        // of the base, the coat and the fibres
#endif
#if COAT_NORMALS
    Frame base_frame, coat_frame;   // relative to the frame of the unbent normal
#endif
#if SHEEN
    real3 sheen;
    Fibres fibres;
#endif
#if THROUGH
    real3 through, scattered;   // transmission by a single bounce, and by multiple scattering
#endif
#if THROUGH && MULTIPLE_SCATTERING
    real scattered_scale;
#endif
#if DIFFUSE_THROUGH
    real3 diffuse_through;      // color of light that is transmitted diffusely
    real3 diffuse_o;            // its factor at wo, over the mean
#endif
};

#if COUPLING_ALBEDO
// The light that leaves the body at an angle: albedo·(1 − E).
static inline real3 body_left(const struct metallic_roughness *m, Bounce bounce) {
    return mul(m->albedo, sub(splat(ONE), bounce_albedo(m->body_f0, m->body_f90, bounce)));
}

#if IRIDESCENCE
#define BODY_LEFT(m, bounce, cosine) body_left_at(m, bounce, cosine)
#define LEFT_ALBEDO(m, bounce, cosine) left_albedo_at(m, bounce, cosine)
#else
#define BODY_LEFT(m, bounce, cosine) body_left(m, bounce)
#define LEFT_ALBEDO(m, bounce, cosine) left_albedo(m, bounce)
#endif

// The factor r of the diffuse lobe.
static inline real3 left_albedo(const struct metallic_roughness *m, Bounce bounce) {
    real3 left = body_left(m, bounce);
#if MULTIPLE_SCATTERING
    left = mad3(m->multiple, bounce.lost, left);
#endif
    return left;
}
#endif

#if MULTIPLE_SCATTERING
// Sample around +z with a density proportional to 1/(cos² + alpha²) in cos²: pdf = cos/(pi·spread·(cos² + alpha²)),
// spread = log(1 + 1/alpha²).
static inline real3 sample_multiple(const struct metallic_roughness *m, real2 u) {
    real s, c, z2 = minimum(WIDEST_ALPHA(m) * WIDEST_ALPHA(m) * (exp(u.x * m->spread) - 1.0f), ONE), r = sqrt(1.0f - z2);
    sincos_turns(u.y, &s, &c);
    return vector(r * c, r * s, sqrt(z2));
}
static inline real multiple_pdf(const struct metallic_roughness *m, real cos_theta) {
    return cos_theta / (PI * m->spread * (cos_theta * cos_theta + WIDEST_ALPHA(m) * WIDEST_ALPHA(m)));
}
#endif

#if SPECULAR
#define F90(m) ((m)->f90)
#else
#define F90(m) ONE
#endif

// Schlick's Fresnel approximation.
static inline real3 fresnel_to(real3 f0, real f90, real cos_theta) {
    real c = maximum(1.0f - cos_theta, ZERO), c2 = c * c;
    return mad3(sub(splat(f90), f0), c2 * c2 * c, f0);
}

#if DIFFUSE_THROUGH && !IRIDESCENCE
// The fraction of light that enters the body at an angle.
static inline real3 entering(const struct metallic_roughness *m, Bounce bounce, real cosine) {
    return sub(splat(ONE), bounce_albedo(m->body_f0, m->body_f90, bounce));
}
#endif

#if COUPLING_ALBEDO && IRIDESCENCE
// The fraction of light that enters the body at an angle, where a film may reflect more than its bound.
static inline real3 entering(const struct metallic_roughness *m, Bounce bounce, real cosine) {
    real3 plain = fresnel_to(m->film_f0, m->body_f90, cosine);
    real3 here = f0_of(with_film(&m->thin_film, m->film_f0, plain, cosine), m->body_f90, cosine), most = m->body_f0;
    here = vector(maximum(here.x, most.x), maximum(here.y, most.y), maximum(here.z, most.z));
    return sub(splat(ONE), bounce_albedo(here, m->body_f90, bounce));
}

static inline real3 body_left_at(const struct metallic_roughness *m, Bounce bounce, real cosine) {
    return mul(m->albedo, entering(m, bounce, cosine));
}

static inline real3 left_albedo_at(const struct metallic_roughness *m, Bounce bounce, real cosine) {
    real3 left = body_left_at(m, bounce, cosine);
#if MULTIPLE_SCATTERING
    left = mad3(m->multiple, bounce.lost, left);
#endif
    return left;
}
#endif

static inline real3 base_fresnel(const struct metallic_roughness *m, real cos_theta) {
#if IRIDESCENCE
    real3 plain = fresnel_to(m->f0, F90(m), cos_theta);
    ireal covered = m->thin_film.strength > 0.0f, dielectric = covered & (m->metallic < 1.0f), metal = covered & (m->metallic > 0.0f);
    real3 film = splat(ZERO);
    if (ANY(dielectric)) film = scale(film_fresnel(&m->thin_film, m->film_f0, cos_theta), 1.0f - m->metallic);
    if (ANY(metal)) film = mad3(film_fresnel(&m->thin_film, m->metal_f0, cos_theta), m->metallic, film);
    return choose(covered, mad3(sub(film, plain), m->thin_film.strength, plain), plain);
#else
    return fresnel_to(m->f0, F90(m), cos_theta);
#endif
}

// 1 − F, with 1 − (1 − c)^5 expanded so that it keeps its precision at grazing angles.
static inline real3 transmitted(const struct metallic_roughness *m, real c) {
    real rest = c * (5.0f - c * (10.0f - c * (10.0f - c * (5.0f - c))));
    return mad3(sub(splat(F90(m)), m->f0), rest, splat(1.0f - F90(m)));
}

#if LAYERS
static inline void lay_over(struct metallic_roughness *m, const Surface *surface, real specular_o, real multiple_o,
                            real diffuse_o);
#endif

static inline real inverse_or_zero(real x) { return x > 0.0f ? 1.0f / x : ZERO; }

static inline LobeShares lobe_shares(real specular, real multiple, real diffuse) {
    real sum = specular + multiple + diffuse, inverse = inverse_or_zero(sum);
    return (LobeShares){sum > 0.0f ? specular * inverse : ONE, multiple * inverse, diffuse * inverse};
}

static inline struct metallic_roughness metallic_roughness_at(const Scene *scene, ireal index, const Surface *surface) {
    struct metallic_roughness m;
    real3 color = COLOR(metallic_roughness), specular = PARAMETER3(metallic_roughness, f0);
    real metallic = PARAMETER(metallic_roughness, metallic), roughness = PARAMETER(metallic_roughness, roughness);
    real f90 = ONE;
#if SPECULAR
    f90 = PARAMETER(metallic_roughness, specular);
    specular = mul(specular, PARAMETER3(metallic_roughness, specular_color));
    specular = scale(vector(minimum(specular.x, ONE), minimum(specular.y, ONE), minimum(specular.z, ONE)), f90);
    m.f90 = f90 + (1.0f - f90) * metallic;
#endif
    m.f0 = mad3(sub(color, specular), metallic, specular);
    m.albedo = scale(color, 1.0f - metallic);
    m.alpha = maximum(roughness * roughness, (real)(ALPHA_MIN));
    m.smith = TO_INT(PARAMETER(metallic_roughness, smith));
    m.coupling = TO_INT(PARAMETER(metallic_roughness, coupling));
#if IRIDESCENCE
    m.thin_film.strength = PARAMETER(metallic_roughness, iridescence);
    m.thin_film.ior = PARAMETER(metallic_roughness, iridescence_ior);
    real thinnest = PARAMETER(metallic_roughness, iridescence_thickness_minimum);
    real thickest = PARAMETER(metallic_roughness, iridescence_thickness);
    m.thin_film.thickness = mix(thinnest, thickest, PARAMETER(metallic_roughness, iridescence_thickness_map));
    ireal covered = m.thin_film.strength > 0.0f;
    m.film_f0 = specular;
    m.metal_f0 = color;
    m.metallic = metallic;
    // What is left to the lobes below.
    if (ANY(covered)) {
        real3 bound = mad3(sub(film_bound(&m.thin_film, specular), specular), m.thin_film.strength, specular);
        specular = choose(covered, bound, specular);
        f90 = covered ? mix(f90, ONE, m.thin_film.strength) : f90;
    }
#endif
#if CLEARCOAT
    m.coat = PARAMETER(metallic_roughness, clearcoat);
    m.coat_alpha = maximum(square(PARAMETER(metallic_roughness, clearcoat_roughness)), (real)(ALPHA_MIN));
    if (ANY(m.coat > 0.0f)) m.coat_bounces = height_correlated_albedo(m.coat_alpha);
#endif
#if COAT_NORMALS
    Frame frame = frame_around(surface->unbent);
    m.base_frame = frame_around(to_local(frame, surface->ns));
    m.coat_frame = frame_around(to_local(frame, surface->coat_normal));
#endif
#if ANISOTROPY
    ireal has_tangents;
    real3 axis = anisotropic_axis(scene, index, surface, &has_tangents), towards = surface->towards;
#if COAT_NORMALS
    axis = to_local(m.base_frame, to_local(frame, axis));
    towards = to_local(m.base_frame, to_local(frame, towards));
#else
    Frame frame = frame_around(surface->ns);
    axis = to_local(frame, axis);
    towards = to_local(frame, towards);
#endif
    real strength = has_tangents ? PARAMETER(metallic_roughness, anisotropy) : ZERO;
    m.anisotropy = anisotropy_of(scene, index, m.alpha, strength, axis);
    m.alpha = sqrt(m.anisotropy.alpha_t * m.anisotropy.alpha_b);
#endif
#if SHEEN
    m.sheen = PARAMETER3(metallic_roughness, sheen_color);
    m.fibres = fibres_of(PARAMETER(metallic_roughness, sheen_roughness));
#endif
#if THROUGH
    real transmission = PARAMETER(metallic_roughness, transmission);
    m.through = scale(m.albedo, transmission);
    m.scattered = scale(m.through, PARAMETER(metallic_roughness, multiple));
    m.albedo = scale(m.albedo, 1.0f - transmission);
#endif
#if DIFFUSE_THROUGH
    real diffuse_transmission = PARAMETER(metallic_roughness, diffuse_transmission), body = (1.0f - metallic) * diffuse_transmission;
#if THROUGH
    body *= 1.0f - transmission;
#endif
    m.diffuse_through = scale(PARAMETER3(metallic_roughness, diffuse_transmission_color), body);
    m.albedo = scale(m.albedo, 1.0f - diffuse_transmission);
#endif
#if LAYER_ENERGY
    m.scene = scene;
    m.first_entry = TO_INT(PARAMETER(metallic_roughness, layer_energy));
#endif
#if LAYER_ROWS
    m.row = m.last_row = PARAMETER3(metallic_roughness, last_rows);
    m.row.x *= sqrt(roughness);
#if CLEARCOAT
    m.row.y *= sqrt(PARAMETER(metallic_roughness, clearcoat_roughness));
#endif
#if SHEEN
    m.row.z *= sqrt(PARAMETER(metallic_roughness, sheen_roughness));
#endif
#endif
#if GGX_ALBEDO
    m.bounces = bounces_of(m.alpha, m.smith);
#if ANISOTROPY_ALBEDO
    ireal anisotropic = is_anisotropic(&m.anisotropy);
    if (ANY(anisotropic)) m.bounces.mean = choose_bounce(anisotropic, anisotropic_mean(&m.anisotropy), m.bounces.mean);
#endif
#endif
#if MULTIPLE_SCATTERING
    real lost = m.bounces.mean.lost;
    real3 f = choose(BY_ALBEDO(&m), color, m.f0);
    f = mad3(f, (real)(20.0f / 21.0f), splat((real)(1.0f / 21.0f)));     // the mean of F, weighted by cosines
#if IRIDESCENCE
    f = with_film(&m.thin_film, choose(BY_ALBEDO(&m), color, m.f0), f, (real)(2.0f / 3.0f));     // the mean cosine
#endif
    real3 kept = sub(splat(ONE), scale(f, lost));
    real part = PARAMETER(metallic_roughness, multiple) * (BY_ALBEDO(&m) ? metallic : ONE) * (1.0f - lost);
    m.multiple = scale(vector(f.x * f.x / kept.x, f.y * f.y / kept.y, f.z * f.z / kept.z), part);
    m.spread = log(1.0f + 1.0f / square(WIDEST_ALPHA(&m)));
#endif
    real cos_o = maximum(surface->cos_o, ZERO);
    real3 fresnel_o = base_fresnel(&m, cos_o);
    real specular_o = luminance(fresnel_o), multiple_o = ZERO;
    real diffuse_o = luminance(mul(sub(splat(ONE), fresnel_o), m.albedo));
#if GGX_ALBEDO
#if ANISOTROPY_ALBEDO
    Bounce bounce_o = bounce_at(&m.anisotropy, &m.bounces, vector(towards.x, towards.y, cos_o));
#else
    Bounce bounce_o = ggx_bounce(&m.bounces, cos_o);
#endif
    specular_o = m.coupling == 0 ? luminance(bounce_albedo(m.f0, F90(&m), bounce_o)) : specular_o;
#if IRIDESCENCE
    specular_o = covered ? luminance(fresnel_o) * (1.0f - bounce_o.lost) : specular_o;
#endif
#endif
#if MULTIPLE_SCATTERING
    m.lost_o = bounce_o.lost * inverse_or_zero(lost);     // forms that no material needs have no fits in the program
    multiple_o = luminance(m.multiple) * bounce_o.lost;
#endif
#if COUPLING_ALBEDO || THROUGH
    m.body_f0 = specular;
    m.body_f90 = f90;
#endif
#if COUPLING_ALBEDO
    real3 mean = left_albedo(&m, m.bounces.mean), left = LEFT_ALBEDO(&m, bounce_o, cos_o);
#if LAYERS
    m.left_o = left;
#else
    m.left_o = vector(left.x * inverse_or_zero(mean.x), left.y * inverse_or_zero(mean.y), left.z * inverse_or_zero(mean.z));
#endif
    diffuse_o = BY_ALBEDO(&m) ? luminance(BODY_LEFT(&m, bounce_o, cos_o)) : diffuse_o;
#endif
#if DIFFUSE_THROUGH
    m.diffuse_o = entering(&m, bounce_o, cos_o);
#endif
#if LAYERS
    lay_over(&m, surface, specular_o, multiple_o, diffuse_o);
#else
    m.shares = lobe_shares(specular_o, multiple_o, diffuse_o);
#endif
    return m;
}

#include "bsdf/metallic_roughness_lobes.cl"
#include LAYERS_FILE
