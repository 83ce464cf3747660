// Images without light, of the first surface that camera rays hit; 0 on a miss. World frame.
//
// The files first_surface_*.cl provide
//
//   picture_value(scene, launch, direction, t, &surface) the value of a surface at t along the ray, before
//                                                        turn_towards
#include "integrator/camera_rays.cl"
#include "surface/surface.cl"
#include PICTURE
#include "visibility/interface.cl"

static inline real3 seen_along(const Scene *scene, const Launch *launch, const CameraRay *ray, ireal active, Sampler *sampler,
                               ureal *rays, real3 *direct, real *removed ALPHA_PARAMETER) {
    *rays += active ? (ureal)(1) : (ureal)(0);
#if PRIMITIVES
    Hits hits = first_surface(scene, ray->origin, ray->direction, true, active, sampler);
    Surface surface = surface_at(scene, ray->origin, ray->direction, &hits);
    ireal hit = active & (hits.primitive >= 0);
#if ALPHA
    *alpha = hit ? ONE : ZERO;
#endif
    if (!ANY(hit)) return splat(ZERO);
    return choose(hit, picture_value(scene, launch, ray->direction, hits.t, &surface), splat(ZERO));
#else
    return splat(ZERO);
#endif
}
