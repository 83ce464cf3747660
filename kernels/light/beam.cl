// Spot light whose intensity/d² falls linearly in the angle from the axis, from 1 at the inner cone to 0 at the outer
// one, as in Mitsuba. World frame.
#include "light/interface.cl"

static inline LightSample beam_light_sample(const Scene *scene, ireal index, real3 p, real2 u) {
    LightSample s;
    s.target = GATHER3(scene->beam_lights, index, .position);
    real3 d = sub(s.target, p);
    real d2 = dot3(d, d), inverse = rsqrt(d2);
    s.wi = scale(d, inverse);
    // The chord between unit vectors keeps the precision of small angles.
    real3 off_axis = add(s.wi, GATHER3(scene->beam_lights, index, .axis));
    real angle = 2.0f * asin(minimum(0.5f * length3(off_axis), ONE));
    real f = (GATHER(real, scene->beam_lights, index, .outer) - angle) * GATHER(real, scene->beam_lights, index, .slope);
    f = minimum(maximum(f, ZERO), ONE);
    s.radiance = scale(GATHER3(scene->beam_lights, index, .intensity), f * inverse * inverse);
#if LIGHT_RANGES
    s.radiance = scale(s.radiance, within_range(d2, GATHER(real, scene->beam_lights, index, .per_range2)));
#endif
    s.pdf = ONE;
    s.infinite = NO_LANES;
    s.delta = ALL_LANES;
    return s;
}
