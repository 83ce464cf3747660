// The rays of all lanes for BVHs whose boxes are tested by geometry/box.cl, set up together.
#include "geometry/box.cl"
#include "traverse/leaf.cl"

typedef struct { LeafRays leaves; SlabRays slabs; } TreeRays;

static inline TreeRays tree_rays(const Scene *scene, real3 origin, real3 direction, real t_max) {
    return (TreeRays){leaf_rays(origin, direction), slab_rays(direction)};
}
