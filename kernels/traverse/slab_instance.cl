// Instances in BVHs whose boxes are tested by geometry/box.cl: sets up the ray in an instance's object frame.
#include "geometry/box.cl"
#include "traverse/leaf.cl"
#include "traverse/instance.cl"

static inline bool in_world(const LeafRay *ray) { return ray->ray.instance == IN_WORLD; }

// Transform the ray into the frame of the instance at `place`; return the root of its BVH.
static inline int enter_instance(const Scene *scene, const Ray *world, int place, LeafRay *leaf, SlabRay *slabs) {
    VISIT(instances, place);
    Ray ray = object_ray(scene, world, place);
    real3 origin = broadcast(ray.origin), direction = broadcast(ray.direction);
    LeafRays leaves = leaf_rays(origin, direction);
    SlabRays all = slab_rays(direction);
    *leaf = leaf_ray(&leaves, &ray, 0);
    *slabs = slab_ray(&all, &ray, 0);
    return RECORD(scene->instances, place)->root;
}
