// Thin-lens camera that distorts (camera/brown_conrady.cl): the rays through an image position meet where the ray of the
// distorted pinhole reaches the plane of focus (camera/thin_lens.cl). right, up, forward: as long as the distance of
// that plane. World frame.
#include "core/sampling.cl"
#include "camera/brown_conrady.cl"

static inline ireal ray_through(const Launch *launch, real sx, real sy, Sampler *sampler, CameraRay *ray) {
    real3 right = broadcast(launch->right), up = broadcast(launch->up), forward = broadcast(launch->forward);
    real2 place, at = sample_disc(next_2d(sampler), (real)(launch->lens_radius));
    ireal found = undistorted(launch, sx, sy, &place);
    real3 in_focus = mad3(right, place.x, mad3(up, -place.y, forward));
    real3 on_lens = mad3(normalize3(right), at.x, scale(normalize3(up), at.y));
    *ray = (CameraRay){add(broadcast(launch->position), on_lens), normalize3(sub(in_focus, on_lens))};
    return found;
}
