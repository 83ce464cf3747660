// Auxiliary images for a denoiser: albedo and normal of the first visible non-specular surface.
//
// One work-item takes LANES pixels and averages `sample_count` camera rays per pixel. Rays follow mirrors and glass,
// taking the likelier of reflection and refraction since guides should be noise-free. They record the first surface
// that is neither, as Open Image Denoise recommends, with its albedo tinted by the specular colors and by absorption
// in glass. The sky, suns included, stores its radiance, clamped to 1, as albedo, and no normal; with ALPHA it stores
// nothing where the camera sees it. World frame.
//
// To add one: add a field to the record GUIDE (clrt/rendering/compile/records.py) and to Seen, and compute it below.
#include "integrator/camera_rays.cl"
#include "film/film.cl"
#include "light/dispatch.cl"
#include "surface/shading.cl"
#include "visibility/interface.cl"

typedef struct { real3 albedo, normal; } Seen;

static inline Seen seen_along(const Scene *scene, real3 eye, real3 view, ireal active, int max_depth,
                              Sampler *sampler) {
    Seen seen = {splat(ZERO), splat(ZERO)};
    real3 origin = eye, direction = view, tint = splat(ONE);
#if ATTENUATION
    real3 absorption = splat(ZERO);
#endif
    for (int depth = 1;; ++depth) {
        Hits hits = first_surface(scene, origin, direction, depth == 1, active, sampler);
        Surface surface = surface_at(scene, origin, direction, &hits);
        ireal hit = active & (hits.primitive >= 0);
#if ATTENUATION
        tint = mul(tint, attenuated(absorption, hit ? hits.t : (real)(INFINITY)));
#endif
#if ENVIRONMENT
        ireal escaped = active & !hit;
#if ALPHA
        escaped = escaped & (depth > 1 ? ALL_LANES : NO_LANES);
#endif
        if (ANY(escaped)) {
            real3 sky = environment_radiance(scene, choose(escaped, direction, vector(ZERO, ONE, ZERO))
                                             CAMERA_ARGUMENT(depth == 1));
            real3 bounded = vector(minimum(sky.x, ONE), minimum(sky.y, ONE), minimum(sky.z, ONE));
            seen.albedo = choose(escaped, mul(tint, bounded), seen.albedo);
        }
#endif
        if (!ANY(hit)) return seen;
#if PRIMITIVES
        Shading shading = shading_at(scene, direction, &surface);
        real middle = (real)(0.5f);
        BsdfSample sample = shading_sample(&shading, &surface, (real2){middle, middle}, middle);
        ireal followed = hit & sample.specular & (sample.pdf > 0.0f);
        ireal ends = hit & !followed;
        seen.albedo = choose(ends, mul(tint, bsdf_albedo(&shading.bsdf)), seen.albedo);
        seen.normal = choose(ends, surface.ns, seen.normal);
        if (depth >= max_depth || !ANY(followed)) return seen;
        tint = choose(followed, mul(tint, sample.weight), tint);
#if ATTENUATION
        absorption = absorption_along(&shading, &surface, sample.wi, absorption);
#endif
        origin = offset_origin(surface.p, surface.p_error, surface.ng, sample.wi);
        direction = sample.wi;
        active = followed;
#endif
    }
}

__attribute__((vec_type_hint(real)))
kernel void guides(SCENE_PARAMETERS, global Guide *pixels, global const uint *tiles, const Launch launch) {
    Scene scene = SCENE_ARGUMENTS;
    LanePixels own;
    if (!lane_pixels(&launch, tiles, &own)) return;
    Seen sum = {splat(ZERO), splat(ZERO)};
    for (uint s = 0; s < launch.sample_count; ++s) {
        Sampler sampler = sampler_at(own.code, (ureal)(s), launch.seed, launch.block_bits);
        SET_TIME(scene, launch, sampler, own.y)
        CameraRay ray;
        ireal active = own.inside & camera_ray(&scene, &launch, own.x, own.y, next_2d(&sampler), &sampler, &ray);
        Seen seen = seen_along(&scene, ray.origin, ray.direction, active, launch.max_depth, &sampler);
        sum.albedo = add(sum.albedo, seen.albedo);
        sum.normal = add(sum.normal, seen.normal);
    }
    if (loops_ended(launch.width)) return;
    real share = (real)(1.0f / (float)launch.sample_count);
    real3 albedo = scale(sum.albedo, share), normal = scale(sum.normal, share);
    for (int lane = 0; lane < LANES; ++lane) {
        if (!LANE_INT(own.inside, lane)) continue;
        global Guide *pixel = pixels + LANE_UINT(own.index, lane);
        store_rows(pixel->albedo, &albedo, lane);
        store_rows(pixel->normal, &normal, lane);
    }
}
