// GGX, the distribution of microfacets' normals h (Walter et al. 2007, eq. 33), which of them hide each other (Smith), and
// those visible from wo drawn (Dupuy and Benyoub 2023, "Sampling Visible GGX Normals with Spherical Caps"). Local frame.
#include "sampling.cl"

#define ALPHA_MIN 1e-4f   // below, D(h) leaves float32's range

// Walter's D(h), with the denominator summed so that a tiny alpha keeps its digits at the lobe's centre.
static inline real ggx_d(real3 h, real alpha) {
    real a2 = alpha * alpha;
    real s = (h.x * h.x + h.y * h.y) + a2 * h.z * h.z;
    return a2 / (PI * s * s);
}

// Smith's Lambda of GGX; G1 = 1/(1 + Lambda).
static inline real ggx_lambda(real3 w, real alpha) {
    real t = alpha * alpha * (w.x * w.x + w.y * w.y) / (w.z * w.z);
    return 0.5f * t / (1.0f + sqrt(1.0f + t));   // (sqrt(1 + t) − 1)/2 without cancellation
}

// A normal visible from wo: stretch, draw a point of the cap of directions, unstretch.
static inline real3 sample_visible_normal(real3 wo, real alpha, real2 u) {
    real3 stretched = normalize3(vector(wo.x * alpha, wo.y * alpha, wo.z));
    real s, c;
    sincos_turns(u.x, &s, &c);
    real z = 1.0f - u.y * (1.0f + stretched.z);
    real radius = safe_sqrt(1.0f - z * z);
    real3 h = add(vector(radius * c, radius * s, z), stretched);
    return normalize3(vector(h.x * alpha, h.y * alpha, maximum(h.z, (real)(1e-30f))));
}
