// Warps of the unit square and their pdfs. Directions are unit vectors; pdfs are per solid angle.
#include "core/vector.cl"

// sin and cos of 2·pi·u for u in [0, 1): octant reduction and minimax polynomials on [-pi/4, pi/4], error < 1.1e-7. The
// built-in functions handle arguments of any size and are several times as expensive.
static inline void sincos_turns(real u, real *sine, real *cosine) {
    ireal q = TO_INT(u * 4.0f + 0.5f);
    real x = (u * 4.0f - TO_REAL(q)) * (0.5f * PI);
    real x2 = x * x;
    real s = x + x * x2 * (-1.6666654611e-1f + x2 * (8.3321608736e-3f + x2 * -1.9515295891e-4f));
    real c = 1.0f - 0.5f * x2 + x2 * x2 * (4.166664568298827e-2f + x2 * (-1.388731625493765e-3f + x2 * 2.443315711809948e-5f));
    ireal swapped = (q & 1) != 0;
    real sine_ = swapped ? c : s, cosine_ = swapped ? s : c;
    *sine = (q & 2) != 0 ? -sine_ : sine_;
    *cosine = ((q + 1) & 2) != 0 ? -cosine_ : cosine_;
}

// Uniform over a disc around 0: pdf = 1/(pi·radius²).
static inline real2 sample_disc(real2 u, real radius) {
    real s, c, r = radius * sqrt(u.x);
    sincos_turns(u.y, &s, &c);
    return (real2){r * c, r * s};
}

// Cosine-weighted hemisphere around +z (Malley): pdf = z/pi.
static inline real3 sample_cosine(real2 u) {
    real2 below = sample_disc(u, ONE);
    return vector(below.x, below.y, safe_sqrt(1.0f - u.x));
}
static inline real cosine_pdf(real cos_theta) { return maximum(cos_theta, ZERO) * (1.0f / PI); }

// Uniform in the cone around +z with 1 − cosθ ≤ `height`: pdf = 1/(2·pi·height). In terms of 1 − cosθ so that a cone of
// 1e-4 degrees keeps its precision.
static inline real3 sample_cone(real2 u, real height) {
    real s, c, h = u.x * height;
    sincos_turns(u.y, &s, &c);
    real sin_theta = safe_sqrt(h * (2.0f - h));
    return vector(sin_theta * c, sin_theta * s, 1.0f - h);
}
static inline real cone_pdf(real height) { return 1.0f / (2.0f * PI * height); }

// Barycentric coordinates uniform over a triangle: (b1, b2), pdf = 1/area (Turk 1990).
static inline real2 sample_triangle(real2 u) {
    real root = sqrt(u.x);
    return (real2){root * (1.0f - u.y), root * u.y};
}

// Power heuristic (Veach 1997, eq. 9.15, power 2), safe for infinite and huge densities.
static inline real power_heuristic(real pdf, real other) {
    real ratio = other / pdf;
    return 1.0f / (1.0f + ratio * ratio);
}
