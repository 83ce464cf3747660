// Falloff of spot lights, f²: f falls linearly in the cosine of the angle from the axis, from 1 at the inner cone to 0
// at the outer one (Khronos, KHR_lights_punctual).
//
// Cosines are stored as 1 − cos, so that narrow cones keep their precision.
//
// ANGULAR_SPOTS: where the slope is negative, f² falls linearly in the angle instead, and `outer` is one.
#include "light/interface.cl"

// f in the direction −wi, from 0 to 1.
static inline real cone_factor(real3 wi, real3 axis, real outer, real slope) {
    real3 off_axis = add(wi, axis);
    real height = 0.5f * dot3(off_axis, off_axis);
#if ANGULAR_SPOTS
    ireal angular = slope < 0.0f;
    height = angular ? 2.0f * asin(minimum(sqrt(0.5f * height), ONE)) : height;
    real f = (outer - height) * fabs(slope);
    f = angular ? safe_sqrt(minimum(f, ONE)) : f;
#else
    real f = (outer - height) * slope;
#endif
    return minimum(maximum(f, ZERO), ONE);
}
