// Rays that are given one by one (clrt/scene/ray_list.py), each to as many consecutive pixels as it has REPLICAS. World
// frame. ON_SURFACES: they start at surfaces, whose geometric normals are given, too.
#define LISTED_RAYS 1

static inline ireal listed_ray(const Scene *scene, const Launch *launch, ureal x, ureal y, CameraRay *ray) {
    ireal index = AS_INT((y * launch->width + x) / REPLICAS);
    ray->origin = GATHER3(scene->listed_rays, index, .origin);
    ray->direction = GATHER3(scene->listed_rays, index, .direction);
#if ON_SURFACES
    ray->surface_normal = GATHER3(scene->listed_rays, index, .surface_normal);
    ray->reach = GATHER(real, scene->listed_rays, index, .reach);
#endif
    return ALL_LANES;
}
