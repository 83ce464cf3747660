// Smith's masking–shadowing term G2 of GGX, in the forms that the scene's materials use.
static inline real smith_shadowing(real3 wo, real3 wi, real alpha, ireal smith) {
    real g = ZERO;
    real lambda_o = ggx_lambda(wo, alpha), lambda_i = ggx_lambda(wi, alpha);
#if SMITH_HEIGHT_CORRELATED
    g = smith == 0 ? 1.0f / (1.0f + lambda_o + lambda_i) : g;
#endif
#if SMITH_SEPARABLE
    g = smith == 1 ? 1.0f / ((1.0f + lambda_o) * (1.0f + lambda_i)) : g;
#endif
#if SMITH_SCHLICK || SMITH_SCHLICK_IBL
    real r = sqrt(alpha);
    real k = smith == 2 ? square(r + 1.0f) * 0.125f : alpha * 0.5f;
    real schlick = wo.z * wi.z / ((wo.z * (1.0f - k) + k) * (wi.z * (1.0f - k) + k));
    g = smith >= 2 ? schlick : g;
#endif
    return g;
}
