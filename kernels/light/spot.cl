// Spot light: intensity·falloff/d². World frame.
#include "light/cone.cl"

static inline LightSample spot_light_sample(const Scene *scene, ireal index, real3 p, real2 u) {
    real d2;
    LightSample s = sample_of_point(GATHER3(scene->spot_lights, index, .position), p, &d2);
    real inverse = rsqrt(d2);
    real f = cone_factor(s.wi, GATHER3(scene->spot_lights, index, .axis),
                         GATHER(real, scene->spot_lights, index, .outer),
                         GATHER(real, scene->spot_lights, index, .slope)) * inverse;
    s.radiance = scale(GATHER3(scene->spot_lights, index, .intensity), f * f);
#if LIGHT_RANGES
    s.radiance = scale(s.radiance, within_range(d2, GATHER(real, scene->spot_lights, index, .per_range2)));
#endif
    return s;
}
