// A path a lane: a work-item follows LANES pixels, one path each, through `sample_count` samples.
#include "camera.cl"
#include "edge.cl"
#include "film.cl"

// What arrives at the eye; direct: what of it came with two edges at most, where that is compiled in.
static inline real3 radiance(const Scene *scene, CameraRay ray, ireal active, int max_depth, Sampler *sampler, ureal *rays,
                             real3 *direct) {
    real3 L = splat(ZERO);
    Path path = path_along(ray.origin, ray.direction);
    for (int depth = 1;; ++depth) {
        *rays += active ? (ureal)(1) : (ureal)(0);
        Surface surface;
        Hits hits = first_surface(scene, &path.origin, path.wi, active, sampler, &surface);
        ireal hit = active & (hits.primitive >= 0);
        absorb(&path, hit ? hits.t : (real)(INFINITY));
        L = add(L, emitted_light(scene, &path, &surface, hits.t, hit));
        L = add(L, sky_light(scene, &path, active & !hit));
#if DIRECT_LIGHT
        if (depth <= 2) *direct = L;
#endif
        active = hit;
        if (depth >= max_depth || !ANY(active)) return L;
#if PRIMITIVES
        Shading shading = shading_at(scene, &path, &surface);
#if LIGHTS
        ShadowRay shadow;
        ireal sent = aim_at_light(scene, &path, &surface, &shading, active, sampler, &shadow);
        *rays += sent ? (ureal)(1) : (ureal)(0);
        if (ANY(sent)) L = add(L, light_along(scene, &shadow, sent));
#endif
        active = go_on(&path, &surface, &shading, active, depth, sampler);
#endif
    }
}

__attribute__((vec_type_hint(real)))
kernel void path(SCENE_PARAMETERS, global Pixel *film, global const uint *tiles, const Launch launch) {
    Scene scene = SCENE_ARGUMENTS;
    LanePixels own;
    if (!lane_pixels(&launch, tiles, &own)) return;
    Accumulator pixels = load_pixels(film, AS_INT(own.index));
    for (uint s = 0; s < launch.sample_count; ++s) {
        Sampler sampler = sampler_at(own.code, (ureal)(launch.first_sample + s), launch.seed, launch.block_bits);
        CameraRay ray = camera_ray(&scene, &launch, own.x, own.y, next_2d(&sampler), &sampler);
        real3 direct;
        real3 L = radiance(&scene, ray, own.inside, launch.max_depth, &sampler, &pixels.rays, &direct);
        ireal kept = accumulate(&pixels, L, own.inside);
#if DIRECT_LIGHT
        accumulate_direct(&pixels, direct, kept);
#endif
    }
    store_pixels(film, own.index, own.inside, &pixels);
}
