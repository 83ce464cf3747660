// Orthographic camera: parallel rays along forward, unit; right, up: half the image's width and height. World frame.
#include "core/vector.cl"

static inline ireal ray_through(const Launch *launch, real sx, real sy, Sampler *sampler, CameraRay *ray) {
    real3 right = broadcast(launch->right), up = broadcast(launch->up);
    *ray = (CameraRay){mad3(right, sx, mad3(up, -sy, broadcast(launch->position))), broadcast(launch->forward)};
    return ALL_LANES;
}
