// The Beckmann distribution of microfacet normals h, with Smith's masking in the rational form of Walter et al. (2007).
// Local frame; w.z may be negative. Directions are sampled from GGX of the same alpha, which is at least e/4 of it.

static inline real beckmann_d(real3 h, real alpha) {
    real a2 = alpha * alpha, z2 = h.z * h.z;
    return exp(-(h.x * h.x + h.y * h.y) / (a2 * z2)) / (PI * a2 * z2 * z2);
}

// Smith's Lambda for Beckmann; G1 = 1/(1 + Lambda).
static inline real beckmann_lambda(real3 w, real alpha) {
    real a = absolute(w.z) / (alpha * sqrt(maximum(w.x * w.x + w.y * w.y, (real)(1e-30f))));
    real lambda = (1.0f - 1.259f * a + 0.396f * a * a) / (3.535f * a + 2.181f * a * a);
    return a < 1.6f ? maximum(lambda, ZERO) : ZERO;
}

// G2: separable, or height-correlated.
static inline real beckmann_masking(real3 wo, real3 wi, real alpha, ireal separable) {
    real o = beckmann_lambda(wo, alpha), i = beckmann_lambda(wi, alpha);
    return 1.0f / (1.0f + o + i + (separable ? o * i : ZERO));
}
