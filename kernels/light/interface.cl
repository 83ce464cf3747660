// The interface of a light type; its file provides, with NAME being its name:
//
//   NAME_light_sample(scene, index, p, u)              samples a direction from p towards the light
//
// It reads what its class in clrt/scene/lights.py returns from `parameters`: GATHER3(scene->NAME_lights, index, .x).
// Emissive surfaces also provide
//
//   NAME_light_pdf(scene, index, p, wi, t, surface)    its pdf per solid angle at wi
//   NAME_light_radiance(scene, index, wi, surface)     radiance along wi from the surface that the ray hit
//
// The sky is seen by rays that escape: sky_radiance(scene, wi, &pdf) returns its radiance and that pdf; likewise
// sun_radiance(scene, sun, wi, &pdf) for each sun that has a size.
//
// World frame; wi: unit, from p to the light; u in [0,1)², on which directions depend continuously as far as possible.
// Lights draw no random numbers themselves: a lane's numbers must not depend on the choices of its neighbours.
#include "surface/surface.cl"
#include "core/sampling.cl"

typedef struct {
    real3 wi;
    real3 radiance;     // along wi, unoccluded; the irradiance perpendicular to wi of a light without a size
    real pdf;           // per solid angle; 1 for a light without a size
    real3 target;       // end of the shadow ray, see shadow_target; undefined if `infinite`
    ireal infinite;
    ireal delta;        // no ray hits the light, so its samples count in full
} LightSample;

// A sample of a light without a size at `position`, but for its radiance. *d2: the squared distance to p.
static inline LightSample sample_of_point(real3 position, real3 p, real *d2) {
    real3 d = sub(position, p);
    *d2 = dot3(d, d);
    LightSample s;
    s.target = position;
    s.wi = scale(d, rsqrt(*d2));
    s.pdf = ONE;
    s.infinite = NO_LANES;
    s.delta = ALL_LANES;
    return s;
}

#if LIGHT_RANGES
// Attenuation by a light's range at the squared distance d2: 1 − (d/range)⁴, 0 beyond (KHR_lights_punctual).
static inline real within_range(real d2, real per_range2) {
    real share = d2 * per_range2;
    return maximum(1.0f - share * share, ZERO);
}
#endif

// A point q on a light's surface, moved towards p by more than its rounding error and that of a ray between the two, so
// that the ray ends before the light. With OPACITY it is moved away from p, as the ray ends where it hits the light:
// surfaces that coincide with the light come before or after it in the order of hits. size: |a| + |b| if q = a + b,
// since the rounding error of terms that cancel remains.
static inline real3 shadow_target(real3 p, real3 q, real3 size, real3 n) {
    real distance = dot3(absolute3(n), scale(add(absolute3(p), size), (real)(GAMMA(16))));
#if OPACITY
    distance = -distance;
#endif
    return mad3(n, dot3(sub(p, q), n) < 0.0f ? -distance : distance, q);
}
