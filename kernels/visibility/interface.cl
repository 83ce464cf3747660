// Visibility. The file that stands for VISIBILITY provides
//
//   first_surface_from(scene, &closest, origin, direction, from_camera, active, &sampler)
//                       the hits of the first surfaces that stop rays whose closest hits are known
//   transmittance(scene, origin, light, target, wi, infinite, active)
//                       the transmittance to `origin` from the target on a light, or from infinity along wi
#include VISIBILITY

// The hits of the first surfaces that stop rays. from_camera: see opacity_at (surface/opacity.cl).
static inline Hits first_surface(const Scene *scene, real3 origin, real3 direction, int from_camera, ireal active,
                                 Sampler *sampler) {
    Hits closest = closest_hit(scene, origin, direction, (real)(INFINITY), active);
    return first_surface_from(scene, &closest, origin, direction, from_camera, active, sampler);
}
