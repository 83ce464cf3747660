// The upper level of a two-level tree: its leaves are instances, each a tree of its own in another frame.
//
// A ray that comes to an instance goes on in the object's frame from that tree's root, with LEAVE on the stack under it;
// when that comes up again all of the instance has been seen, and the ray is back in the world's frame. Directions are not
// brought to unit length, so t means the same in all frames.

#define LEAVE 0x7ffffffe
#define IN_WORLD -1

// With explicit fma there is nothing left to contract: all layouts and devices see the same ray.
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
