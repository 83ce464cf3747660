// Rays that are given one by one (clrt/scene/ray_list.py), each to as many consecutive pixels as it has REPLICAS. World
// frame.
#define LISTED_RAYS 1

static inline ireal listed_ray(const Scene *scene, const Launch *launch, ureal x, ureal y, CameraRay *ray) {
    ireal index = AS_INT((y * launch->width + x) / REPLICAS);
    *ray = (CameraRay){GATHER3(scene->listed_rays, index, .origin), GATHER3(scene->listed_rays, index, .direction)};
    return ALL_LANES;
}
