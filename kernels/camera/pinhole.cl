// Pinhole camera (Suchiński 3.1, Nadolny algorithm 2): d = a·f·(2x/w − 1)·r − f·(2y/h − 1)·u + v, normalised, with
// f = tan(fov/2), a = w/h. right: a·f·r; up: f·u; forward: v, or with a lens shift the vector to the image's centre.
// World frame.
#include "core/vector.cl"

static inline ireal ray_through(const Launch *launch, real sx, real sy, Sampler *sampler, CameraRay *ray) {
    real3 right = broadcast(launch->right), up = broadcast(launch->up), forward = broadcast(launch->forward);
    *ray = (CameraRay){broadcast(launch->position), normalize3(mad3(right, sx, mad3(up, -sy, forward)))};
    return ALL_LANES;
}
