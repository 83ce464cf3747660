// Ambient occlusion at listed points (camera/listed_rays.cl; a ray's direction is the shading normal): the fraction of
// the hemisphere, weighted by the cosine, in which no surface is nearer than the ray's reach. Directions below the
// geometric surface count as blocked.
#include "integrator/camera_rays.cl"
#include "core/sampling.cl"
#include "visibility/interface.cl"

#define NO_LIGHT -2   // surfaces without light have -1

static inline real3 seen_along(const Scene *scene, const Launch *launch, const CameraRay *ray, ireal active, Sampler *sampler,
                               ureal *rays, real3 *direct, real *removed) {
    real3 error = splat(largest(absolute3(ray->origin)) * GAMMA(9)), ng = ray->surface_normal;
    real3 wi = to_world(frame_around(ray->direction), sample_cosine(next_2d(sampler)));
    ireal sent = active & (dot3(wi, ng) > 0.0f);
    *rays += sent ? (ureal)(1) : (ureal)(0);
    if (!ANY(sent)) return splat(ZERO);
    real3 origin = offset_origin(ray->origin, error, ng, wi);
    real3 target = mad3(wi, ray->reach, origin);
    return splat(transmittance(scene, origin, (ireal)(NO_LIGHT), target, wi, ray->reach <= 0.0f, sent));
}
