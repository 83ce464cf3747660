// Spot light: intensity·f²/d², where f falls linearly in the cosine of the angle from the axis, from 1 at the inner
// cone to 0 at the outer one (Khronos, KHR_lights_punctual). World frame.
//
// Cosines are stored as 1 − cos, so that narrow cones keep their precision.
//
// ANGULAR_SPOTS: where the slope is negative, f² falls linearly in the angle instead, and `outer` is one.
#include "light/interface.cl"

static inline LightSample spot_light_sample(const Scene *scene, ireal index, real3 p, real2 u) {
    LightSample s;
    s.target = GATHER3(scene->spot_lights, index, .position);
    real3 d = sub(s.target, p);
    real d2 = dot3(d, d), inverse = rsqrt(d2);
    s.wi = scale(d, inverse);
    real3 off_axis = add(s.wi, GATHER3(scene->spot_lights, index, .axis));
    real height = 0.5f * dot3(off_axis, off_axis);
#if ANGULAR_SPOTS
    real slope = GATHER(real, scene->spot_lights, index, .slope);
    ireal angular = slope < 0.0f;
    height = angular ? 2.0f * asin(minimum(sqrt(0.5f * height), ONE)) : height;
    real f = (GATHER(real, scene->spot_lights, index, .outer) - height) * fabs(slope);
    f = angular ? safe_sqrt(minimum(f, ONE)) : f;
#else
    real f = (GATHER(real, scene->spot_lights, index, .outer) - height) * GATHER(real, scene->spot_lights, index, .slope);
#endif
    f = minimum(maximum(f, ZERO), ONE) * inverse;
    s.radiance = scale(GATHER3(scene->spot_lights, index, .intensity), f * f);
#if LIGHT_RANGES
    s.radiance = scale(s.radiance, within_range(d2, GATHER(real, scene->spot_lights, index, .per_range2)));
#endif
    s.pdf = ONE;
    s.infinite = NO_LANES;
    s.delta = ALL_LANES;
    return s;
}
