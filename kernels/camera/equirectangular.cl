// All directions: longitude to the right, latitude up, forward in the middle. Looking along +Z with +Y up, a direction falls
// where it does in the environment's picture (light/image_sky.cl). right, up, forward: unit. World frame.
#include "sampling.cl"

#define ALL_AROUND 1    // nothing lies behind

// Beyond its ends the picture goes on: around, and over the poles.
static inline real wrapped(real turns) { return turns - floor(turns); }

static inline CameraRay ray_through(const Launch *launch, real sx, real sy, Sampler *sampler) {
    real3 right = broadcast(launch->right), up = broadcast(launch->up), forward = broadcast(launch->forward);
    real sin_phi, cos_phi, sin_theta, cos_theta;   // of the angle right of backward, and of that from up
    sincos_turns(wrapped(0.5f + 0.5f * sx), &sin_phi, &cos_phi);
    sincos_turns(wrapped(0.25f + 0.25f * sy), &sin_theta, &cos_theta);
    real3 level = sub(scale(right, -sin_phi), scale(forward, cos_phi));
    return (CameraRay){broadcast(launch->position), mad3(level, sin_theta, scale(up, cos_theta))};
}
