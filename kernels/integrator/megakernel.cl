// Megakernel: each lane computes one sample at a time; a work-item renders LANES pixels with `sample_count` samples
// each.
//
// INTEGRATOR provides
//
//   seen_along(scene, launch, &ray, active, &sampler, &rays, &direct, &removed ALPHA_ARGUMENT(&alpha)
//              CATCHER_ARGUMENT(&caught) GROUPS_ARGUMENT(groups))
//                                         radiance along the camera rays, 0 in inactive lanes; adds the number of rays
//                                         traced to `rays`; sets `direct` if DIRECT_LIGHT is compiled in; adds the
//                                         energy removed by clamping to `removed` if CLAMP is, and the coverage to
//                                         `alpha` if ALPHA is; sets `caught` if CATCHER is; adds the light by light
//                                         group to `groups` if EMITTER_GROUPS is
//
// PIXEL_MIDDLE: all samples use the ray through the pixel centre, at the middle of the exposure.
#include "integrator/camera_rays.cl"
#include "film/film.cl"
#include INTEGRATOR

__attribute__((vec_type_hint(real)))
kernel void megakernel(SCENE_PARAMETERS, global Pixel *film, global const uint *tiles, const Launch launch) {
    Scene scene = SCENE_ARGUMENTS;
    CHOOSE_WORLD(scene, launch)
    LanePixels own;
    if (!lane_pixels(&launch, tiles, &own)) return;
    Accumulator pixels = load_pixels(film, AS_INT(own.index));
    for (uint s = 0; s < launch.sample_count; ++s) {
        Sampler sampler = sampler_at(own.code, (ureal)(launch.first_sample + s), launch.seed, launch.block_bits);
#if PIXEL_MIDDLE
        SET_MIDDLE_TIME(scene, launch, own.y)
        real2 place = {(real)(0.5f), (real)(0.5f)};
#else
        SET_TIME(scene, launch, sampler, own.y)
        real2 place = next_2d(&sampler);
#endif
        CameraRay ray;
        ireal active = own.inside & camera_ray(&scene, &launch, own.x, own.y, place, &sampler, &ray);
        real3 direct;
        real removed = ZERO;
#if ALPHA
        real alpha = ZERO;
#endif
#if CATCHER
        ireal caught = NO_LANES;
#endif
#if EMITTER_GROUPS
        real3 groups[GROUPS];
        for (int g = 0; g < GROUPS; ++g) groups[g] = splat(ZERO);
#endif
        real3 seen = seen_along(&scene, &launch, &ray, active, &sampler, &pixels.rays, &direct, &removed
                                ALPHA_ARGUMENT(&alpha) CATCHER_ARGUMENT(&caught) GROUPS_ARGUMENT(groups));
#if CATCHER
        if (launch.bare) {
            accumulate_bare(&pixels, seen, own.inside);
            continue;
        }
#endif
        ireal kept = accumulate(&pixels, seen, own.inside);
#if CLAMP
        pixels.clamped += kept ? removed : ZERO;
#endif
#if DIRECT_LIGHT
        accumulate_direct(&pixels, direct, kept);
#endif
#if ALPHA
        accumulate_alpha(&pixels, alpha, kept);
#endif
#if CATCHER
        accumulate_caught(&pixels, seen, kept & caught);
        kept = kept & !caught;
#endif
#if EMITTER_GROUPS
        for (int g = 0; g < GROUPS; ++g) accumulate_group(&pixels, g, groups[g], kept);
#endif
    }
    store_pixels(film, own.index, own.inside, &pixels);
}
