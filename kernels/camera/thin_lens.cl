// Thin-lens camera: all rays through one image position meet in a point of the plane of focus, and are distributed
// uniformly over the lens (Cook, Porter and Carpenter 1984, "Distributed Ray Tracing"). The lens is centred on the
// pinhole, so a point at the distance d is seen as a disc, which on the plane of focus, at s, has the radius
// lens_radius·|s − d|/d.
//
// right, up, forward: the pinhole's times s, so that they reach the plane of focus. World frame.
#include "core/sampling.cl"

static inline ireal ray_through(const Launch *launch, real sx, real sy, Sampler *sampler, CameraRay *ray) {
    real3 right = broadcast(launch->right), up = broadcast(launch->up), forward = broadcast(launch->forward);
    real3 in_focus = mad3(right, sx, mad3(up, -sy, forward));
    real2 at = sample_disc(next_2d(sampler), (real)(launch->lens_radius));
    real3 on_lens = mad3(normalize3(right), at.x, scale(normalize3(up), at.y));
    *ray = (CameraRay){add(broadcast(launch->position), on_lens), normalize3(sub(in_focus, on_lens))};
    return ALL_LANES;
}
