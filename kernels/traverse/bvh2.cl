// Binary BVH (Nadolny 5.4.4–5.4.5): 32-byte nodes, siblings adjacent, one triangle at a time.
//
// Both children are tested at their parent; the nearer is visited, the farther is pushed with its distance on a stack
// whose size the host computed for this BVH, so that it cannot overflow. count = 0 is an interior node, count > 0 a
// leaf of triangles, count < 0 of spheres; first is the left child or the leaf's first primitive, in the top level of a
// two-level BVH its instance.
#include "traverse/slab_rays.cl"
#include UPPER_LEVEL

static inline float enter_box(const SlabRay *ray, global const Node *node, float t_max) {
    float t_near = FIRST_T(ray), t_far = t_max;
    for (int axis = 0; axis < 3; ++axis) {
        float low = node->aabb_min[axis], high = node->aabb_max[axis];
        float near = ((ray->backward[axis] ? high : low) - ray->origin[axis]) * ray->near[axis];
        float far = ((ray->backward[axis] ? low : high) - ray->origin[axis]) * ray->far[axis];
        t_near = near > t_near ? near : t_near;
        t_far = far < t_far ? far : t_far;
    }
    return t_near <= t_far ? t_near : INFINITY;
}

static inline void hit_leaf(const Scene *scene, const LeafRay *ray, int first, int count, const bool stop_at_first, Hit *hit) {
#if LEAF_SPHERES
    if (count < 0) {
        VISIT(spheres, first);
        hit_spheres(ray, RECORD(scene->leaf_spheres, first), -count, hit);
        return;
    }
#endif
#if TRIANGLES
    for (int i = first; i < first + count; ++i) {
        VISIT(tests, i);
        hit_triangles(ray, RECORD(scene->leaf_triangles, i), stop_at_first, hit);
    }
#endif
}

static inline Hit traverse(const Scene *scene, const TreeRays *rays, const Ray *ray, int lane, const int search,
                           const Hit *nearest) {
    Hit hit = *nearest;
    LeafRay leaf = leaf_ray(&rays->leaves, ray, lane);
    SlabRay slabs = slab_ray(&rays->slabs, ray, lane);
    int waiting[STACK_SIZE];
    float distance[STACK_SIZE];
    int top = 0, node = 0;
    if (enter_box(&slabs, RECORD(scene->nodes, 0), hit.t) == INFINITY) return hit;
    for (;;) {
        int count = RECORD(scene->nodes, node)->count, first = RECORD(scene->nodes, node)->left_first;
        if (count == 0) {
            VISIT(nodes, first);
            float left = enter_box(&slabs, RECORD(scene->nodes, first), hit.t);
            float right = enter_box(&slabs, RECORD(scene->nodes, first + 1), hit.t);
            bool left_first = left <= right;
            float near = left_first ? left : right, far = left_first ? right : left;
            if (far < INFINITY) {
                waiting[top] = left_first ? first + 1 : first;
                distance[top++] = far;
            }
            if (near < INFINITY) {
                node = left_first ? first : first + 1;
                continue;
            }
        } else {
#if INSTANCES
            if (in_world(&leaf)) {
                waiting[top] = LEAVE;
                distance[top++] = -INFINITY;
                node = enter_instance(scene, ray, first, &leaf, &slabs);
                continue;
            }
#endif
            VISIT(leaves, first);
            hit_leaf(scene, &leaf, first, count, search == SEARCH_ANY, &hit);
            if (ends_search(scene, search, &hit)) return hit;
        }
        do {
            if (top == 0) return hit;
            node = waiting[--top];
#if INSTANCES
            if (node == LEAVE) {
                leaf = leaf_ray(&rays->leaves, ray, lane);
                slabs = slab_ray(&rays->slabs, ray, lane);
            }
        } while (distance[top] > hit.t || node == LEAVE);
#else
        } while (distance[top] > hit.t);
#endif
    }
}
