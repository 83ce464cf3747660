// Pinhole camera whose lens distorts (camera/brown_conrady.cl). right, up, forward: unit. World frame.
#include "camera/brown_conrady.cl"

static inline ireal ray_through(const Launch *launch, real sx, real sy, Sampler *sampler, CameraRay *ray) {
    real3 right = broadcast(launch->right), up = broadcast(launch->up), forward = broadcast(launch->forward);
    real2 place;
    ireal found = undistorted(launch, sx, sy, &place);
    real3 direction = mad3(right, place.x, mad3(up, -place.y, forward));
    *ray = (CameraRay){broadcast(launch->position), normalize3(direction)};
    return found;
}
