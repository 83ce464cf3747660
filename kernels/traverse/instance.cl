// Top level of a two-level BVH: its leaves are instances, each a BVH of its own in an object frame.
//
// A ray that reaches an instance continues in the object frame from that BVH's root, with LEAVE below it on the stack;
// when LEAVE is popped the instance is finished and the ray returns to the world frame. Directions are not normalised,
// so t is the same in all frames.

#define LEAVE 0x7ffffffe
#define IN_WORLD -1

// Explicit fma leaves nothing to contract: all layouts and devices compute the same ray.
static inline Ray object_ray(const Ray *world, ARRAY(Instance) instances, int place) {
    global const Instance *instance = RECORD(instances, place);
    const float *d = world->direction, *o = world->origin;
    Ray ray = *world;
    for (int k = 0; k < 3; ++k) {
        global const float *row = instance->to_object[k];
        ray.direction[k] = fma(row[0], d[0], fma(row[1], d[1], row[2] * d[2]));
        ray.origin[k] = fma(row[0], o[0], fma(row[1], o[1], fma(row[2], o[2], row[3])));
    }
    ray.instance = instance->index;
    return ray;
}
