// First hits at one position of each pixel, rasterised and traced (clrt/bench/rays/raster_speed.py).
#include "film/film.cl"
#include "surface/surface.cl"
#include "raster/tile.cl"

static void store_seen(global Seen *pixel, const Hits *hits, int lane) {
    pixel->t = LANE(hits->t, lane);
    pixel->u = LANE(hits->u, lane);
    pixel->v = LANE(hits->v, lane);
    pixel->primitive = LANE_INT(hits->primitive, lane);
    pixel->instance = LANE_INT(hits->instance, lane);
}

kernel void raster_hits(SCENE_PARAMETERS, global Seen *rasterised, global Seen *traced, global const uint *tiles,
                        const Launch launch, BIN_PARAMETERS) {
    Scene scene = SCENE_ARGUMENTS;
    Bins bins = BIN_ARGUMENTS;
    LanePixels own[ROWS];
    Row rows[ROWS];
    int count = 0;
    while (count < ROWS && group_pixels(&launch, tiles, (uint)get_global_id(0) * ROWS + count, own + count)) {
        const LanePixels *pixels = own + count;
        Sampler sampler = sampler_at(pixels->code, (ureal)(launch.first_sample), launch.seed, launch.block_bits);
        real2 place = place_in_pixel(&scene, &launch, pixels->x, pixels->y, next_2d(&sampler));
        CameraRay ray;
        ireal seen = pixels->inside & ray_through(&launch, place.x, place.y, &sampler, &ray);
        rows[count++] = row_of(&launch, place, ray, seen);
    }
    if (count == 0) return;
    rasterise(&bins, &launch, LANE_UINT(own[0].x, 0), LANE_UINT(own[0].y, 0), rows, count);
    for (int i = 0; i < count; ++i) {
        Hits one = row_hits(rows + i);
        Hits other = closest_hit(&scene, rows[i].ray.origin, rows[i].ray.direction, (real)(INFINITY), own[i].inside);
        for (int lane = 0; lane < LANES; ++lane) {
            if (!LANE_INT(own[i].inside, lane)) continue;
            uint index = LANE_UINT(own[i].index, lane);
            store_seen(rasterised + index, &one, lane);
            store_seen(traced + index, &other, lane);
            rasterised[index].x = traced[index].x = LANE(rows[i].place.x, lane);
            rasterised[index].y = traced[index].y = LANE(rows[i].place.y, lane);
        }
    }
}
