// What Phong's and Blinn's models share: a power of a cosine around Lambert's law. Local frame.
//
// In the path integrators the body reflects what the gloss leaves, at most 1 − specular, so that no light is made. The local
// integrator (LOCAL) draws both as their authors wrote them, with the irradiance over pi for a light's colour:
//   color·(n·l) + specular·(…)^shininess
#include "sampling.cl"

// x^n for x in [0, 1]; 1 for n = 0.
static inline real power(real x, real n) { return exp(n * log(maximum(x, (real)(1e-30f)))); }

static inline real3 phong_body(real3 color, real3 specular) {
#if LOCAL
    return color;
#else
    return vector(minimum(color.x, 1.0f - specular.x), minimum(color.y, 1.0f - specular.y),
                  minimum(color.z, 1.0f - specular.z));
#endif
}

// The part of the light that the gloss is given, by luminance.
static inline real gloss_share(real3 color, real3 specular) {
    real gloss = luminance(specular), sum = gloss + luminance(color);
    return sum > 0.0f ? gloss / sum : ZERO;
}

// Around +z with a density of (n + 1)/(2·pi)·z^n.
static inline real3 sample_power(real2 u, real n) {
    real s, c, z = power(u.x, 1.0f / (n + 1.0f)), r = safe_sqrt((1.0f - z) * (1.0f + z));
    sincos_turns(u.y, &s, &c);
    return vector(r * c, r * s, z);
}
static inline real power_pdf(real z, real n) { return z > 0.0f ? (n + 1.0f) * (0.5f / PI) * power(z, n) : ZERO; }
