// The GGX distribution of microfacet normals h (Walter et al. 2007, eq. 33), Smith masking, and sampling of visible
// normals (Dupuy and Benyoub 2023, "Sampling Visible GGX Normals with Spherical Caps"). Local frame.
#include "core/sampling.cl"

#define ALPHA_MIN 1e-4f   // below it D(h) exceeds the range of float32

// Walter's D(h), with the denominator arranged so that a tiny alpha keeps its precision at the centre of the lobe.
static inline real ggx_d(real3 h, real alpha) {
    real a2 = alpha * alpha;
    real s = (h.x * h.x + h.y * h.y) + a2 * h.z * h.z;
    return a2 / (PI * s * s);
}

// Smith's Lambda for GGX, (sqrt(1 + s2/z2) − 1)/2 without cancellation, and without overflow where z2 underflows; G1 =
// 1/(1 + Lambda).
static inline real ggx_lambda(real3 w, real alpha) {
    real s2 = alpha * alpha * (w.x * w.x + w.y * w.y), z2 = w.z * w.z;
    return 0.5f * s2 / (z2 + absolute(w.z) * sqrt(z2 + s2));
}

// Sample a normal visible from wo: stretch, sample the spherical cap, unstretch.
static inline real3 sample_visible_normal(real3 wo, real alpha, real2 u) {
    real3 stretched = normalize3(vector(wo.x * alpha, wo.y * alpha, wo.z));
    real s, c;
    sincos_turns(u.x, &s, &c);
    real z = 1.0f - u.y * (1.0f + stretched.z);
    real radius = safe_sqrt(1.0f - z * z);
    real3 h = add(vector(radius * c, radius * s, z), stretched);
    return normalize3(vector(h.x * alpha, h.y * alpha, maximum(h.z, (real)(1e-30f))));
}
