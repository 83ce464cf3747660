// What every light's file provides, by its name:
//
//   NAME_light_sample(scene, index, p, u)              a direction from p towards the light
//   NAME_light_pdf(scene, index, p, wi, t, surface)    density per solid angle with which it chooses wi (0 for points
//                                                      and directions, which no ray meets by chance)
//   NAME_light_radiance(scene, index, wi, surface)     what arrives along wi from the surface that the ray met
//
// The sky is met by missing everything: sky_radiance(scene, wi, &pdf) gives what arrives, and that density; likewise
// sun_radiance(scene, sun, wi, &pdf) of each sun that has a size.
//
// World frame; wi: unit, from p to the light; u in [0,1)², from which directions follow without jumps as far as they can.
// They draw no random numbers themselves: a lane's numbers must not depend on what its neighbours chose.
#include "surface.cl"
#include "sampling.cl"

typedef struct {
    real3 wi;
    real3 radiance;     // arrives along wi if nothing is in between; the irradiance across wi where `delta`
    real pdf;           // per solid angle; 1 where `delta`
    real3 target;       // where the shadow ray ends, just before the light; meaningless where `infinite`
    ireal infinite, delta;
} LightSample;

#if LIGHT_RANGES
// What a light's range leaves at the squared distance d2: 1 − (d/range)⁴, and nothing beyond (KHR_lights_punctual).
static inline real within_range(real d2, real per_range2) {
    real share = d2 * per_range2;
    return maximum(1.0f - share * share, ZERO);
}
#endif

// A point q on a light's surface, moved towards p beyond its rounding error and that of a ray between the two. size:
// |a| + |b| where q = a + b, since the rounding error of terms that cancel remains.
static inline real3 shadow_target(real3 p, real3 q, real3 size, real3 n) {
    real distance = dot3(absolute3(n), scale(add(absolute3(p), size), (real)(GAMMA(16))));
    return mad3(n, dot3(sub(p, q), n) < 0.0f ? -distance : distance, q);
}
