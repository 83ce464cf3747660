// Top level of a two-level BVH: its leaves are instances, each a BVH of its own in an object frame.
//
// A ray that reaches an instance continues in the object frame from that BVH's root, with LEAVE below it on the stack;
// when LEAVE is popped the instance is finished and the ray returns to the world frame. Directions are not normalised,
// so t is the same in all frames. Instances that move are where they are at the ray's time.

#include MOTION_FILE

#define LEAVE 0x7ffffffe
#define IN_WORLD -1

// Explicit fma leaves nothing to contract: all layouts and devices compute the same ray.
static inline Ray object_ray(const Scene *scene, const Ray *world, int place) {
    global const Instance *instance = RECORD(scene->instances, place);
    const float *d = world->direction, *o = world->origin;
    Ray ray = *world;
    ray.instance = instance->index;
#if MOTION
    int number = RECORD(scene->motion_of, instance->index)->motion;
    if (number >= 0) {
        global const Motion *motion = RECORD(scene->motions, number);
        Rotation rotation = rotation_at(motion, world->time);
        moved_back(motion, &rotation, world->time, 0.0f, d, ray.direction);
        moved_back(motion, &rotation, world->time, 1.0f, o, ray.origin);
        return ray;
    }
#endif
    for (int k = 0; k < 3; ++k) {
        global const float *row = instance->to_object[k];
        ray.direction[k] = fma(row[0], d[0], fma(row[1], d[1], row[2] * d[2]));
        ray.origin[k] = fma(row[0], o[0], fma(row[1], o[1], fma(row[2], o[2], row[3])));
    }
    return ray;
}
