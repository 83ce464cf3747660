// The Fresnel equations at the boundary of two dielectrics (Born and Wolf, 1.5.2).
#include "core/sampling.cl"

static inline real fresnel_of_cosines(real cos_o, real cos_t, real eta) {
    real parallel = (eta * cos_o - cos_t) / (eta * cos_o + cos_t);
    real perpendicular = (cos_o - eta * cos_t) / (cos_o + eta * cos_t);
    return 0.5f * (parallel * parallel + perpendicular * perpendicular);
}

// Fresnel reflectance F of unpolarised light at cos_o > 0 from a medium into one of relative index eta; cos_t of the
// refracted direction, 0 for total internal reflection.
static inline real fresnel_dielectric(real cos_o, real eta, real *cos_t) {
    real cos2_t = ((eta - 1.0f) * (eta + 1.0f) + cos_o * cos_o) / (eta * eta);   // 1 − sin²/eta² without cancellation
    *cos_t = safe_sqrt(cos2_t);
    real reflected = fresnel_of_cosines(cos_o, *cos_t, eta);
    return cos2_t > 0.0f ? reflected : ONE;
}
