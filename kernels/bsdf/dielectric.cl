// Glass or water: reflection with the Fresnel probability F, else refraction by Snell's law (pbrt, 4th ed., 9.3 and
// 9.5). `ior` inside, 1 outside; refracted light is multiplied by `color`.
//
// ROUGH_DIELECTRIC: the same at microfacets (rough_dielectric.cl); DIELECTRIC_ENERGY: with multiple scattering between
// them.
// THIN_DIELECTRIC: a sheet with coincident faces. With all internal reflections summed,
//   F + (1 − F)²·c²F/(1 − c²F²) is reflected, 2F/(1 + F) for c = 1, and (1 − F)²·c/(1 − c²F²) is transmitted unbent,
// where c = color is the transmittance from face to face. A rough sheet spreads both alike (as glTF's transmission).
// ATTENUATION: absorption inside by the Beer–Lambert law (integrator/path_segment.cl). A sheet leaves the
// surrounding absorption unchanged.
// TINTED_DIELECTRIC: reflected light is multiplied by `reflectance`. BECKMANN_DIELECTRIC, SEPARABLE_DIELECTRIC: rough
// glass with other microfacets (rough_dielectric.cl).
// DISPERSION: each channel has an index of its own (dispersion.cl).
#include "bsdf/fresnel_dielectric.cl"
#include "bsdf/interface.cl"

#if DISPERSION
// channel: the only one of the path, or −1. etas: eta of each channel.
typedef struct { real3 etas; ireal channel; } Dispersion;
#endif

struct dielectric {
    real3 color;
    real eta;           // index of refraction beyond the surface over that on wo's side
#if ROUGH_DIELECTRIC
    real alpha;         // 0 if smooth
#endif
#if TINTED_DIELECTRIC
    real3 reflectance;
#endif
#if BECKMANN_DIELECTRIC
    ireal beckmann;     // whether the distribution is Beckmann's
#endif
#if SEPARABLE_DIELECTRIC
    ireal separable;    // whether G is
#endif
#if DIELECTRIC_ENERGY
    const Scene *scene;
    ireal index, inside;
    real row, grazing;          // row of the energy table; cosine below which losses are large
    real range, later, returned;    // of multiple scattering (read_later)
#endif
#if THIN_DIELECTRIC
    ireal thin;
#endif
#if ATTENUATION
    real3 absorption;   // beyond the surface, per unit of length
#endif
#if DISPERSION
    Dispersion dispersion;
#endif
};

#if THIN_DIELECTRIC
#define IS_THIN(m) ((m)->thin)
#else
#define IS_THIN(m) NO_LANES
#endif

#if ATTENUATION
static inline real3 dielectric_absorption(const struct dielectric *m, real3 here) {
    return choose(IS_THIN(m), here, m->absorption);
}
#endif

static inline real3 dielectric_albedo(const struct dielectric *m) { return m->color; }

// Fresnel split, given F: the probability of sampling reflection, and the weights of reflection and transmission.
typedef struct {
    real reflected;
    real3 reflection, transmission;
#if BECKMANN_DIELECTRIC
    real3 facet;        // normal of the microfacet
#endif
} Division;

static inline real thin_reflection(real f, real c) {
    return 0.5f * (1.0f + f) * (1.0f + square((1.0f - f) * c) / maximum(1.0f - square(c * f), (real)(UNIT_ROUNDOFF)));
}
static inline real thin_transmission(real f, real c) {
    return c * (1.0f - f * f) / maximum(1.0f - square(c * f), (real)(UNIT_ROUNDOFF));
}

static inline Division divide_light(const struct dielectric *m, real f) {
    Division d;
    d.reflected = f;
    d.reflection = splat(ONE);
    d.transmission = m->color;
#if THIN_DIELECTRIC
    real3 c = m->color;
    real3 back = vector(thin_reflection(f, c.x), thin_reflection(f, c.y), thin_reflection(f, c.z));
    real3 on = vector(thin_transmission(f, c.x), thin_transmission(f, c.y), thin_transmission(f, c.z));
    d.reflected = m->thin ? 2.0f * f / (1.0f + f) : f;
    d.reflection = choose(m->thin, back, d.reflection);
    d.transmission = choose(m->thin, on, d.transmission);
#endif
#if TINTED_DIELECTRIC
    d.reflection = mul(d.reflection, m->reflectance);
#endif
    return d;
}

// Radiance on wo's side over radiance beyond the surface (non-symmetric scattering due to refraction).
static inline real dielectric_spread(const struct dielectric *m) { return IS_THIN(m) ? ONE : 1.0f / (m->eta * m->eta); }

static inline BsdfSample smooth_dielectric_sample(const struct dielectric *m, real3 wo, real lobe) {
    real cos_t;
    Division d = divide_light(m, fresnel_dielectric(wo.z, m->eta, &cos_t));
    ireal reflected = lobe < d.reflected;
    real to_inside = IS_THIN(m) ? ONE : 1.0f / m->eta;
    cos_t = IS_THIN(m) ? wo.z : cos_t;
    BsdfSample sample = no_sample();
    sample.wi = choose(reflected, vector(-wo.x, -wo.y, wo.z), vector(-wo.x * to_inside, -wo.y * to_inside, -cos_t));
    sample.weight = choose(reflected, d.reflection, d.transmission);
    sample.pdf = ONE;
    sample.spread = reflected ? ONE : to_inside * to_inside;
    sample.specular = ALL_LANES;
    return sample;
}

#include ROUGH_DIELECTRIC_FILE
#include DISPERSION_FILE
#if !ROUGH_DIELECTRIC
static inline BsdfValue dielectric_eval(const struct dielectric *m, real3 wo, real3 wi) { return no_value(); }
#endif

static inline struct dielectric dielectric_at(const Scene *scene, ireal index, const Surface *surface) {
    struct dielectric m;
    real ior = PARAMETER(dielectric, ior);
    m.color = COLOR(dielectric);
    m.eta = surface->front ? ior : 1.0f / ior;
#if DISPERSION
    m.dispersion = dispersion_at(ior, PARAMETER(dielectric, dispersion), surface);
    m.eta = m.dispersion.channel < 0 ? m.eta : of_channel(m.dispersion.etas, m.dispersion.channel);
#endif
#if THIN_DIELECTRIC
    m.thin = PARAMETER(dielectric, thin) > 0.0f;
    m.eta = m.thin ? ior : m.eta;
#endif
#if ROUGH_DIELECTRIC
    real roughness = PARAMETER(dielectric, roughness);
    ireal rough = (roughness > 0.0f) & ((ior != 1.0f) | IS_THIN(&m));    // without refraction there is no roughness
    m.alpha = rough ? maximum(roughness * roughness, (real)(ALPHA_MIN)) : ZERO;
#endif
#if TINTED_DIELECTRIC
    m.reflectance = PARAMETER3(dielectric, reflectance);
#endif
#if BECKMANN_DIELECTRIC
    m.beckmann = PARAMETER(dielectric, beckmann) > 0.0f;
#endif
#if SEPARABLE_DIELECTRIC
    m.separable = PARAMETER(dielectric, separable) > 0.0f;
#endif
#if DIELECTRIC_ENERGY
    m.scene = scene;
    m.index = index;
    m.inside = !surface->front;
    m.row = sqrt(roughness) * PARAMETER(dielectric, last_row);
    read_later(&m, ior);
#endif
#if ATTENUATION
    m.absorption = choose(surface->front, PARAMETER3(dielectric, absorption), splat(ZERO));
#endif
    return m;
}

static inline BsdfSample dielectric_sample(const struct dielectric *m, real3 wo, real2 u, real lobe) {
    BsdfSample sample = smooth_dielectric_sample(m, wo, lobe);
#if DISPERSION
    sample = dispersed(m, wo, lobe, sample);
#endif
#if ROUGH_DIELECTRIC
    ireal rough = m->alpha > 0.0f;
    if (ANY(rough)) {
        BsdfSample spread = rough_dielectric_sample(m, wo, u, lobe);
        sample.wi = choose(rough, spread.wi, sample.wi);
        sample.weight = choose(rough, spread.weight, sample.weight);
        sample.pdf = rough ? spread.pdf : sample.pdf;
        sample.spread = rough ? spread.spread : sample.spread;
        sample.specular = sample.specular & !rough;
    }
#endif
    return sample;
}
