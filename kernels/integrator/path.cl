// Path tracing integrator of the megakernel (integrator/megakernel.cl).
#include "integrator/camera_rays.cl"
#include "integrator/path_segments.cl"

static inline real3 seen_along(const Scene *scene, const Launch *launch, const CameraRay *ray, ireal active, Sampler *sampler,
                               ureal *rays, real3 *direct, real *removed ALPHA_PARAMETER CATCHER_PARAMETER) {
    Path path = path_along(ray->origin, ray->direction);
    return light_of_path(scene, launch, &path, 1, active, sampler, rays, direct, removed
                         ALPHA_ARGUMENT(alpha) CATCHER_ARGUMENT(caught));
}
