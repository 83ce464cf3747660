// Fisheye camera (Kannala and Brandt 2006, as in OpenCV): a direction at the angle θ from forward is imaged at the
// distance g(θ) from the optical axis (camera/radial_lens.cl). right, up, forward: unit. World frame.
#include "core/sampling.cl"
#include "camera/radial_lens.cl"

#define ALL_AROUND 1    // θ may exceed a right angle

static inline ireal ray_through(const Launch *launch, real sx, real sy, Sampler *sampler, CameraRay *ray) {
    real3 right = broadcast(launch->right), up = broadcast(launch->up), forward = broadcast(launch->forward);
    real2 at = on_plane(launch, sx, sy);
    real imaged = sqrt(square(at.x) + square(at.y)), residual, sine, cosine;
    real angle = undistorted_radius(launch, imaged, &residual);
    sincos_turns(angle * (0.5f / PI), &sine, &cosine);
    real across = imaged > 0.0f ? sine / imaged : ONE;
    real3 direction = mad3(right, at.x * across, mad3(up, -at.y * across, scale(forward, cosine)));
    *ray = (CameraRay){broadcast(launch->position), normalize3(direction)};
    return absolute(residual) <= RESIDUAL * (1.0f + imaged);
}
