// A camera that moves during the exposure: its position in a straight line, and its axes as geometry/turn.cl turns
// them. What they are in its own frame, which changes with the lens, changes linearly.
#include "geometry/turn.cl"

// The camera at the fraction s of the exposure.
static inline Launch camera_at(const Launch *launch, float s) {
    Launch now = *launch;
    Rotation r = turned_by(launch->turn_middle, launch->turn_change, launch->turn_angle, s);
    float *axes[3] = {now.right, now.up, now.forward};
    for (int axis = 0; axis < 3; ++axis) {
        float own[3];
        for (int k = 0; k < 3; ++k) own[k] = fma(s, launch->axes_change[axis][k], launch->axes[axis][k]);
        axes[axis][0] = along(r.x, own);
        axes[axis][1] = along(r.y, own);
        axes[axis][2] = along(r.z, own);
    }
#if LENS_MOTION
    for (int k = 0; k < 3; ++k) now.across[k] = fma(s, launch->across_change[k], launch->across[k]);
    for (int k = 0; k < 3; ++k) now.down[k] = fma(s, launch->down_change[k], launch->down[k]);
#endif
    for (int k = 0; k < 3; ++k) now.position[k] = fma(s, launch->moved[k], launch->position[k]);
    return now;
}

// As ray_through, at the times of the lanes: camera files compute with one camera.
static inline ireal ray_through_moving(const Scene *scene, const Launch *launch, real sx, real sy, Sampler *sampler,
                                       CameraRay *ray) {
    ireal found = NO_LANES;
    Sampler before = *sampler;
    for (int lane = 0; lane < LANES; ++lane) {
        Launch now = camera_at(launch, LANE(scene->time, lane));
        CameraRay one;
        *sampler = before;
        ireal own = AS_INT(LANE_INDEX) == lane, has = ray_through(&now, sx, sy, sampler, &one);
        found = own ? has : found;
        ray->origin = lane == 0 ? one.origin : choose(own, one.origin, ray->origin);
        ray->direction = lane == 0 ? one.direction : choose(own, one.direction, ray->direction);
    }
    return found;
}
