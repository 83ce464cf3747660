// 8-wide BVH for CPUs with SIMD: a ray is intersected with a node's eight boxes, or a pack of eight triangles, at once.
//
// The nearest child is visited, the others are pushed unsorted with their distances. The host computed the stack size
// for this BVH, so that it cannot overflow. A child reference >= 0 is a node, < 0 is ~(first << 4 | sphere << 3 | count
// − 1), a pack of triangles or `count` spheres, and in the top level of a two-level BVH an instance; empty slots have
// inverted boxes.
#include "traverse/slab_rays.cl"
#include UPPER_LEVEL

static inline void hit_leaf(const Scene *scene, const LeafRay *ray, int reference, const bool stop_at_first, Hit *hit) {
    int leaf = ~reference;
#if LEAF_SPHERES
#if TRIANGLES
    if (leaf & 8)
#endif
    {
        hit_spheres(ray, RECORD(scene->leaf_spheres, leaf >> 4), (leaf & 7) + 1, hit);
        return;
    }
#endif
#if TRIANGLES
    VISIT(tests, leaf >> 4);
    hit_triangles(ray, RECORD(scene->packs, leaf >> 4), stop_at_first, hit);
#endif
}

// Intersect the eight boxes of a node; return the bits of those hit, and their entry distances.
static inline uint enter_boxes(const SlabRay *ray, global const Node *node, float t_max, float *entry) {
    float8 t_near = FIRST_T(ray), t_far = t_max;
    global const float *low = node->lo[0], *high = node->hi[0];
#define SLAB(axis) { \
        float8 near = (vload8(axis, ray->backward[axis] ? high : low) - ray->origin[axis]) * ray->near[axis]; \
        float8 far = (vload8(axis, ray->backward[axis] ? low : high) - ray->origin[axis]) * ray->far[axis]; \
        t_near = near > t_near ? near : t_near; \
        t_far = far < t_far ? far : t_far; \
    }
    SLAB(0)
    SLAB(1)
    SLAB(2)
    vstore8(t_near, 0, entry);
    return mask_bits(t_near <= t_far);
}

__attribute__((always_inline))
static inline Hit traverse(const Scene *scene, const TreeRays *rays, const Ray *ray, int lane, const int search,
                           const Hit *nearest) {
    Hit hit = *nearest;
    LeafRay leaf = leaf_ray(&rays->leaves, ray, lane);
    SlabRay slabs = slab_ray(&rays->slabs, ray, lane);
#if INSTANCES
    const LeafRay world_leaf = leaf;
    const SlabRay world_slabs = slabs;
#endif
    int waiting[STACK_SIZE];
    float distance[STACK_SIZE];
    int top = 0, reference = 0;
    for (;;) {
        if (reference >= 0) {
            VISIT(nodes, reference);
            global const Node *node = RECORD(scene->nodes, reference);
            float entry[8];
            uint entered = enter_boxes(&slabs, node, hit.t, entry);
            if (entered) {
                int nearest = first_bit(entered);
                entered &= entered - 1;
                while (entered) {
                    int child = first_bit(entered);
                    entered &= entered - 1;
                    bool nearer = entry[child] < entry[nearest];
                    int farther = nearer ? nearest : child;
                    nearest = nearer ? child : nearest;
                    waiting[top] = node->child[farther];
                    distance[top++] = entry[farther];
                }
                reference = node->child[nearest];
                continue;
            }
        } else {
#if INSTANCES
            if (leaf.ray.instance == IN_WORLD) {
                Ray object = object_ray(scene, ray, ~reference >> 4);
                TreeRays object_rays = tree_rays(scene, broadcast(object.origin), broadcast(object.direction), (real)(INFINITY));
                leaf = leaf_ray(&object_rays.leaves, &object, 0);
                slabs = slab_ray(&object_rays.slabs, &object, 0);
                waiting[top] = LEAVE;
                distance[top++] = -INFINITY;
                reference = RECORD(scene->instances, object.instance)->root;
                continue;
            }
#endif
            hit_leaf(scene, &leaf, reference, search == SEARCH_ANY, &hit);
            if (ends_search(scene, search, &hit)) return hit;
        }
        for (;;) {
            if (top == 0) return hit;
            reference = waiting[--top];
#if INSTANCES
            if (reference == LEAVE) {
                leaf = world_leaf;
                slabs = world_slabs;
                continue;
            }
#endif
            if (distance[top] <= hit.t) break;
        }
    }
}
