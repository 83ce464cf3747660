// Pictures without light, of what the camera's rays meet first; 0 where they meet nothing. World frame.
//
// The file in picture/ provides
//
//   picture_place(&sampler)                              where in the pixel its ray goes through, see camera_ray
//   picture_value(scene, launch, direction, t, &surface) what the picture has of a surface that is t along the ray, not
//                                                        turned to any side yet
//
// One work-item takes LANES pixels through `sample_count` samples, as path.cl does.
#include "camera.cl"
#include "film.cl"
#include "surface.cl"
#include PICTURE
#include VISIBILITY

static inline real3 seen_along(const Scene *scene, const Launch *launch, const CameraRay *ray, ireal active,
                               Sampler *sampler) {
#if PRIMITIVES
    real3 origin = ray->origin;
    Surface surface;
    Hits hits = first_surface(scene, &origin, ray->direction, active, sampler, &surface);
    ireal hit = active & (hits.primitive >= 0);
    if (!ANY(hit)) return splat(ZERO);
    return choose(hit, picture_value(scene, launch, ray->direction, hits.t, &surface), splat(ZERO));
#else
    return splat(ZERO);
#endif
}

__attribute__((vec_type_hint(real)))
kernel void picture(SCENE_PARAMETERS, global Pixel *film, global const uint *tiles, const Launch launch) {
    Scene scene = SCENE_ARGUMENTS;
    LanePixels own;
    if (!lane_pixels(&launch, tiles, &own)) return;
    Accumulator pixels = load_pixels(film, AS_INT(own.index));
    for (uint s = 0; s < launch.sample_count; ++s) {
        Sampler sampler = sampler_at(own.code, (ureal)(launch.first_sample + s), launch.seed, launch.block_bits);
        CameraRay ray = camera_ray(&scene, &launch, own.x, own.y, picture_place(&sampler), &sampler);
        pixels.rays += own.inside ? (ureal)(1) : (ureal)(0);
        accumulate(&pixels, seen_along(&scene, &launch, &ray, own.inside, &sampler), own.inside);
    }
    store_pixels(film, own.index, own.inside, &pixels);
}
