// Equirectangular (360°) camera: longitude to the right, latitude up, forward in the centre. Looking along +Z with +Y
// up, a direction has the same position as in an environment map (light/image_sky.cl). right, up, forward: unit. World
// frame.
#include "core/sampling.cl"

#define ALL_AROUND 1    // nothing is behind the camera

// Beyond its edges the image wraps around, and over the poles.
static inline real wrapped(real turns) { return turns - floor(turns); }

static inline ireal ray_through(const Launch *launch, real sx, real sy, Sampler *sampler, CameraRay *ray) {
    real3 right = broadcast(launch->right), up = broadcast(launch->up), forward = broadcast(launch->forward);
    real sin_phi, cos_phi, sin_theta, cos_theta;   // of the angle from backward to the right, and of the angle from up
    sincos_turns(wrapped(0.5f + 0.5f * sx), &sin_phi, &cos_phi);
    sincos_turns(wrapped(0.25f + 0.25f * sy), &sin_theta, &cos_theta);
    real3 level = sub(scale(right, -sin_phi), scale(forward, cos_phi));
    *ray = (CameraRay){broadcast(launch->position), mad3(level, sin_theta, scale(up, cos_theta))};
    return ALL_LANES;
}
