// Irradiance over π at listed points (camera/listed_rays.cl; a ray's direction is the shading normal): the radiance of a
// white Lambertian surface there. What that reflects is sampled like any other surface: a light, and a direction by the
// cosine, combined by MIS. No light arrives from below the geometric surface.
#include "integrator/camera_rays.cl"
#include "integrator/path_segments.cl"

#if LIGHTS
// The light sample's part, and whether it needs its shadow ray.
static inline ireal aim_from_point(const Scene *scene, const Path *receiver, real3 ng, real3 error, ireal active,
                                   Sampler *sampler, ShadowRay *ray) {
    ireal number;
    LightSample light = light_sample(scene, receiver->p, receiver->n, sampler, &number);
    real pdf = cosine_pdf(dot3(receiver->n, light.wi));
    real3 contribution = scale(light.radiance, pdf);
    ireal useful = active & !(light.pdf <= 0.0f) & carries_light(contribution) & (dot3(light.wi, ng) > 0.0f);
    real weight = (light.delta ? ONE : light_sample_weight(light.pdf, pdf)) / light.pdf;
    aim(ray, receiver->p, error, ng, &light, number);
    ray->contribution = scale(contribution, weight);
    return useful;
}
#endif

static inline real3 seen_along(const Scene *scene, const Launch *launch, const CameraRay *ray, ireal active, Sampler *sampler,
                               ureal *rays, real3 *direct, real *removed) {
    real3 L = splat(ZERO), n = ray->direction, ng = ray->surface_normal;
#if DIRECT_LIGHT
    *direct = L;
#endif
    if (launch->max_depth < 2) return L;   // the receiver itself is the end of the first segment
    // The points are of surfaces, with a few roundings of their vertices' coordinates.
    real3 error = splat(largest(absolute3(ray->origin)) * GAMMA(9));
    Path path = path_along(ray->origin, n);
#if LIGHTS
    ShadowRay shadow;
    ireal sent = aim_from_point(scene, &path, ng, error, active, sampler, &shadow);
    *rays += sent ? (ureal)(1) : (ureal)(0);
    real3 sampled = ANY(sent) ? light_along(scene, &shadow, sent) : splat(ZERO);
    L = sampled;
#endif
    real3 local_wi = sample_cosine(next_2d(sampler));
    path.wi = to_world(frame_around(n), local_wi);
    path.pdf = cosine_pdf(local_wi.z);
    path.specular = NO_LANES;
    path.origin = offset_origin(ray->origin, error, ng, path.wi);
    active = active & (path.pdf > 0.0f) & (dot3(path.wi, ng) > 0.0f);
    L = add(L, light_of_path(scene, launch, path, 2, active, sampler, rays, direct, removed));
#if DIRECT_LIGHT && LIGHTS
    *direct = add(*direct, sampled);
#endif
    return L;
}
