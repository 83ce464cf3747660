// Isotropic point light: intensity/d² (Suchiński 7.4.1). World frame.
#include "light/interface.cl"

static inline LightSample point_light_sample(const Scene *scene, ireal index, real3 p, real2 u) {
    LightSample s;
    s.target = GATHER3(scene->point_lights, index, .position);
    real3 d = sub(s.target, p);
    real d2 = dot3(d, d), inverse = rsqrt(d2);
    s.wi = scale(d, inverse);
    s.radiance = scale(GATHER3(scene->point_lights, index, .intensity), inverse * inverse);
#if LIGHT_RANGES
    s.radiance = scale(s.radiance, within_range(d2, GATHER(real, scene->point_lights, index, .per_range2)));
#endif
    s.pdf = ONE;
    s.infinite = NO_LANES;
    s.delta = ALL_LANES;
    return s;
}
