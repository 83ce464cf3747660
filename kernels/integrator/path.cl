// Path tracing integrator of the megakernel (integrator/megakernel.cl).
#include "integrator/camera_rays.cl"
#include "integrator/path_segments.cl"

static inline real3 seen_along(const Scene *scene, const Launch *launch, const CameraRay *ray, ireal active, Sampler *sampler,
                               ureal *rays, real3 *direct, real *removed ALPHA_PARAMETER CATCHER_PARAMETER
                               GROUPS_PARAMETER) {
    return light_of_path(scene, launch, path_along(ray->origin, ray->direction), 1, active, sampler, rays, direct, removed
                         ALPHA_ARGUMENT(alpha) CATCHER_ARGUMENT(caught) GROUPS_ARGUMENT(groups));
}
