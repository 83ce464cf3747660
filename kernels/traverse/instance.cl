// The upper level of a two-level tree: its leaves are instances, each a tree of its own in another frame.
//
// A ray that comes to an instance goes on in the object's frame from that tree's root, with LEAVE on the stack under it;
// when that comes up again all of the instance has been seen, and the ray is back in the world's frame. Directions are not
// brought to unit length, so t means the same in all frames.

#define LEAVE 0x7ffffffe
#define IN_WORLD -1

static inline Ray object_ray(const Ray *world, global const Instance *instances, int index) {
    global const Instance *instance = instances + index;
    Ray ray = *world;
    for (int k = 0; k < 3; ++k) {
        global const float *row = instance->to_object[k];
        ray.direction[k] = row[0] * world->direction[0] + row[1] * world->direction[1] + row[2] * world->direction[2];
        ray.origin[k] = row[0] * world->origin[0] + row[1] * world->origin[1] + row[2] * world->origin[2] + row[3];
    }
    ray.instance = index;
    return ray;
}
