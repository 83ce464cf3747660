// Shared parts of Phong and Blinn–Phong: a cosine-power lobe over a Lambertian body. Local frame.
//
// In the path integrators the body reflects what the gloss leaves, at most 1 − specular, which conserves energy. The
// local integrator (LOCAL) uses both in their original form, with the irradiance over pi as the colour of a light:
//   color·(n·l) + specular·(…)^shininess
#include "bsdf/interface.cl"
#include "core/sampling.cl"

// x^n for x in [0, 1]; 1 for n = 0.
static inline real power(real x, real n) { return exp(n * log(maximum(x, (real)(1e-30f)))); }

typedef struct {
    real3 color, specular;
    real shininess;
#if LOCAL
    real ambient;
#endif
} PowerLobes;

#if LOCAL
#define AMBIENT(kind) PARAMETER(kind, ambient)
#else
#define AMBIENT(kind) ZERO
#endif

static inline PowerLobes power_lobes(real3 color, real3 specular, real shininess, real ambient) {
    PowerLobes m;
    m.color = color;
    m.specular = specular;
    m.shininess = shininess;
#if LOCAL
    m.ambient = ambient;
#else
    real3 left = sub(splat(ONE), specular);
    m.color = vector(minimum(color.x, left.x), minimum(color.y, left.y), minimum(color.z, left.z));
#endif
    return m;
}

static inline real3 lobes_albedo(const PowerLobes *m) {
#if LOCAL
    return scale(m->color, m->ambient);
#else
    return add(m->color, m->specular);
#endif
}

// The fraction of samples given to the glossy lobe, by luminance.
static inline real gloss_share(const PowerLobes *m) {
    real gloss = luminance(m->specular), sum = gloss + luminance(m->color);
    return sum > 0.0f ? gloss / sum : ZERO;
}

// Sample around +z with pdf (n + 1)/(2·pi)·z^n.
static inline real3 sample_power(real2 u, real n) {
    real s, c, z = power(u.x, 1.0f / (n + 1.0f)), r = safe_sqrt((1.0f - z) * (1.0f + z));
    sincos_turns(u.y, &s, &c);
    return vector(r * c, r * s, z);
}
static inline real power_pdf(real z, real n) { return z > 0.0f ? (n + 1.0f) * (0.5f / PI) * power(z, n) : ZERO; }
