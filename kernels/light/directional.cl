// Directional light: a delta light at infinity; `towards` is the unit vector to it. sun.cl has suns with a size. World
// frame.
#include "light/interface.cl"

static inline LightSample directional_light_sample(const Scene *scene, ireal index, real3 p, real2 u) {
    LightSample s;
    s.wi = s.target = GATHER3(scene->directional_lights, index, .towards);
    s.radiance = GATHER3(scene->directional_lights, index, .irradiance);
    s.pdf = ONE;
    s.infinite = s.delta = ALL_LANES;
    return s;
}
