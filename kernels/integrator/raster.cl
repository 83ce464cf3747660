// The `raster` integrator: as `local`, but the first hits of camera rays are rasterised and rays are traced from there
// on. Samples have the same positions in their pixels as there.
#include "film/film.cl"
#include "integrator/local.cl"
#include "raster/tile.cl"

__attribute__((vec_type_hint(real)))
kernel void raster(SCENE_PARAMETERS, global Pixel *film, global const uint *tiles, const Launch launch, BIN_PARAMETERS) {
    Scene scene = SCENE_ARGUMENTS;
    Bins bins = BIN_ARGUMENTS;
    LanePixels own[ROWS];
    Accumulator pixels[ROWS];
    int count = 0;   // of rows inside the image
    while (count < ROWS && group_pixels(&launch, tiles, (uint)get_global_id(0) * ROWS + count, own + count)) {
        pixels[count] = load_pixels(film, AS_INT(own[count].index));
        ++count;
    }
    if (count == 0) return;
    for (uint s = 0; s < launch.sample_count; ++s) {
        Row rows[ROWS];
        Sampler samplers[ROWS];
        for (int i = 0; i < count; ++i) {
            samplers[i] = sampler_at(own[i].code, (ureal)(launch.first_sample + s), launch.seed, launch.block_bits);
            real2 place = place_in_pixel(&scene, &launch, own[i].x, own[i].y, next_2d(samplers + i));
            CameraRay ray;
            ireal seen = own[i].inside & ray_through(&launch, place.x, place.y, samplers + i, &ray);
            rows[i] = row_of(&launch, place, ray, seen);
        }
        rasterise(&bins, &launch, LANE_UINT(own[0].x, 0), LANE_UINT(own[0].y, 0), rows, count);
        for (int i = 0; i < count; ++i) {
            Hits closest = row_hits(rows + i);
#if ALPHA
            real alpha = ZERO;
#endif
            real3 L = local_light(&scene, &launch, &rows[i].ray, &closest, own[i].inside, samplers + i, &pixels[i].rays
                                  ALPHA_ARGUMENT(&alpha));
#if ALPHA
            accumulate_alpha(pixels + i, alpha, accumulate(pixels + i, L, own[i].inside));
#else
            accumulate(pixels + i, L, own[i].inside);
#endif
        }
    }
    for (int i = 0; i < count; ++i) store_pixels(film, own[i].index, own[i].inside, pixels + i);
}
