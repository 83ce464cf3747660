// Isotropic point light: intensity/d² (Suchiński 7.4.1). World frame.
#include "light/interface.cl"

static inline LightSample point_light_sample(const Scene *scene, ireal index, real3 p, real2 u) {
    real d2;
    LightSample s = sample_of_point(GATHER3(scene->point_lights, index, .position), p, &d2);
    real inverse = rsqrt(d2);
    s.radiance = scale(GATHER3(scene->point_lights, index, .intensity), inverse * inverse);
#if LIGHT_RANGES
    s.radiance = scale(s.radiance, within_range(d2, GATHER(real, scene->point_lights, index, .per_range2)));
#endif
    return s;
}
