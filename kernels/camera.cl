// Pinhole camera (Suchiński 3.1, Nadolny algorithm 2): d = a·f·(2x/w − 1)·r − f·(2y/h − 1)·u + v, normalised, with
// (x, y) drawn from the filter around the pixel's middle, f = tan(fov/2), a = w/h. World frame; the host folds a·f and f
// into right and up.
#include "sampler.cl"
#include "vector.cl"
#include FILTER

static inline real3 camera_direction(const Scene *scene, const Launch *launch, ureal x, ureal y, real2 u) {
    real sx = 2.0f * (TO_REAL(x) + filter_sample(scene, u.x)) / (float)launch->width - 1.0f;
    real sy = 2.0f * (TO_REAL(y) + filter_sample(scene, u.y)) / (float)launch->height - 1.0f;
    real3 right = broadcast(launch->right), up = broadcast(launch->up), forward = broadcast(launch->forward);
    return normalize3(mad3(right, sx, mad3(up, -sy, forward)));
}
