// Pinhole camera (Suchiński 3.1, Nadolny algorithm 2): d = a·f·(2x/w − 1)·r − f·(2y/h − 1)·u + v, normalised, with
// (x, y) drawn from the filter around the pixel's middle, f = tan(fov/2), a = w/h. World frame; the host folds a·f and f
// into right and up.
#include "sampler.cl"
#include "vector.cl"
#include FILTER

// What the lanes of a work-item see: pixels in a row from `first` on. A lane past the launch's `end` is given the first one
// and is not `inside`.
typedef struct {
    uint first, end;
    ureal index, x, y, code;
    ireal inside;
} LanePixels;

static inline LanePixels lane_pixels(const Launch *launch) {
    LanePixels p;
    p.first = launch->first_pixel + (uint)get_global_id(0) * LANES;
    p.end = launch->first_pixel + launch->pixel_count;
    p.index = (ureal)(p.first) + LANE_INDEX;
    p.inside = p.index < p.end;
    p.index = p.inside ? p.index : (ureal)(p.first);
    p.y = p.index / launch->width;
    p.x = p.index - p.y * launch->width;
    p.code = pixel_code(p.x, p.y);
    return p;
}

static inline real3 camera_direction(const Scene *scene, const Launch *launch, ureal x, ureal y, real2 u) {
    real sx = 2.0f * (TO_REAL(x) + filter_sample(scene, u.x)) / (float)launch->width - 1.0f;
    real sy = 2.0f * (TO_REAL(y) + filter_sample(scene, u.y)) / (float)launch->height - 1.0f;
    real3 right = broadcast(launch->right), up = broadcast(launch->up), forward = broadcast(launch->forward);
    return normalize3(mad3(right, sx, mad3(up, -sy, forward)));
}
