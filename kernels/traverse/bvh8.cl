// An 8-wide tree for processors with vectors: a ray meets a node's eight boxes, or a pack of eight triangles, at once.
//
// The nearest child is entered, the others wait unsorted with their distances; who only asks whether there is a hit needs
// neither. What will be visited later is fetched early. The host computed the stack's size for this very tree, so that it
// cannot overflow. A child reference >= 0 is a node, < 0 is ~(first << 4 | sphere << 3 | count − 1), a pack of
// triangles or `count` spheres; in the upper level of two it is an instance. Empty slots have boxes turned inside out.
#include "geometry/boxes.cl"
#include "traverse/leaf.cl"
#include UPPER_LEVEL

static inline void hit_leaf(const Scene *scene, const LeafRay *ray, int reference, const bool stop_at_first, Hit *hit) {
    int leaf = ~reference;
#if SPHERES
#if TRIANGLES
    if (leaf & 8)
#endif
    {
        hit_spheres(ray, scene->leaf_spheres + (leaf >> 4), (leaf & 7) + 1, hit);
        return;
    }
#endif
#if TRIANGLES
    hit_triangles(ray, scene->packs + (leaf >> 4), stop_at_first, hit);
#endif
}

static inline void fetch(const Scene *scene, int reference) {
    global const void *node = scene->nodes + reference;
#if TRIANGLES
    node = reference < 0 ? (global const void *)(scene->packs + (~reference >> 4)) : node;
#endif
    PREFETCH(node, 5 * 64)
}

typedef struct { LeafRays leaves; BoxRays boxes; } TreeRays;   // of all lanes
typedef struct { BoxRay boxes; LeafRay leaf; } TreeRay;

static inline TreeRays tree_rays(real3 origin, real3 direction) {
    return (TreeRays){leaf_rays(origin, direction), box_rays(origin, direction)};
}

static inline TreeRay tree_ray(const TreeRays *rays, const Ray *ray, int lane) {
    return (TreeRay){box_ray(&rays->boxes, lane), leaf_ray(&rays->leaves, ray, lane)};
}

#if INSTANCES
static inline bool in_world(const TreeRay *ray) { return ray->leaf.ray.instance == IN_WORLD; }

// The ray in the frame of the instance that a leaf of the upper level stands for, and the root of its tree.
static inline TreeRay enter_instance(const Scene *scene, const TreeRay *world, int reference, int *root) {
    int index = ~reference >> 4;
    Ray ray = object_ray(&world->leaf.ray, scene->instances, index);
    TreeRays rays = tree_rays(broadcast(ray.origin), broadcast(ray.direction));
    *root = scene->instances[index].root;
    return tree_ray(&rays, &ray, 0);
}
#endif

static inline Hit any_of_all(const Scene *scene, const TreeRay *world) {
    TreeRay ray = *world;
    Hit hit = {ray.leaf.ray.t_max, 0.0f, 0.0f, -1};
    int waiting[STACK_SIZE + 8], top = 1;   // store_lanes may write over eight more
    waiting[0] = 0;
    while (top > 0 && hit.primitive < 0) {
        int reference = waiting[--top];
#if INSTANCES
        if (reference == LEAVE) {
            ray = *world;
            continue;
        }
        if (reference < 0 && in_world(&ray)) {
            waiting[top++] = LEAVE;
            ray = enter_instance(scene, world, reference, waiting + top++);
            continue;
        }
#endif
        if (reference >= 0) {
            global const Node *node = scene->nodes + reference;
            float8 entry;
            uint entered = enter_boxes(&ray.boxes, node->lo[0], hit.t, &entry);
            store_lanes(vload8(0, node->child), entered, waiting + top);
            top += popcount(entered);
        } else {
            hit_leaf(scene, &ray.leaf, reference, true, &hit);
        }
    }
    return hit;
}

static inline Hit closest_of_all(const Scene *scene, const TreeRay *world) {
    TreeRay ray = *world;
    Hit hit = {ray.leaf.ray.t_max, 0.0f, 0.0f, -1};
    int waiting[STACK_SIZE];
    float distance[STACK_SIZE];
    int top = 0, reference = 0;
    for (;;) {
        if (reference >= 0) {
            global const Node *node = scene->nodes + reference;
            float8 entries;
            uint entered = enter_boxes(&ray.boxes, node->lo[0], hit.t, &entries);
            float entry[8];
            vstore8(entries, 0, entry);
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
                    fetch(scene, waiting[top]);
                    distance[top++] = entry[farther];
                }
                reference = node->child[nearest];
                continue;
            }
        } else {
#if INSTANCES
            if (in_world(&ray)) {
                waiting[top] = LEAVE;
                distance[top++] = -INFINITY;
                ray = enter_instance(scene, world, reference, &reference);
                continue;
            }
#endif
            hit_leaf(scene, &ray.leaf, reference, false, &hit);
        }
        do {
            if (top == 0) return hit;
            reference = waiting[--top];
#if INSTANCES
            if (reference == LEAVE) ray = *world;
        } while (distance[top] > hit.t || reference == LEAVE);
#else
        } while (distance[top] > hit.t);
#endif
    }
}

__attribute__((always_inline)) static inline Hit traverse(const Scene *scene, const TreeRays *rays, const Ray *ray, int lane,
                                                          const bool stop_at_first) {
    TreeRay world = tree_ray(rays, ray, lane);
    return stop_at_first ? any_of_all(scene, &world) : closest_of_all(scene, &world);
}
