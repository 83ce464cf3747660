// Many rays in flight in one work-item, for the layout bvh8 on processors whose caches are far from their memory.
//
// POOL rays take turns, a step each: a node or a leaf, and while the others have theirs, what a ray needs next is fetched.
// A ray that is done leaves its place to the next one. Steps are without branches where that can be; rays at nodes and
// rays at leaves are listed apart, so that a step's kind need not be guessed.
#include "traverse/bvh8.cl"

#define DONE 0x7fffffff

typedef struct {
    TreeRay ray;
    Hit hit;
    int reference, top;
    uint index;     // the host's of the ray, and what its t is multiplied by
    float to_t;
#if INSTANCES
    TreeRay world;
#endif
    int waiting[1 + STACK_SIZE + 8];   // the first says DONE and is never too far; store_lanes may write over eight more
    float distance[1 + STACK_SIZE + 8];
} Flight;

static inline void take_off(Flight *f, const TreeRays *rays, const Ray *ray, int lane, uint index, float to_t) {
    f->ray = tree_ray(rays, ray, lane);
#if INSTANCES
    f->world = f->ray;
#endif
    f->hit = (Hit){ray->t_max, 0.0f, 0.0f, -1};
    f->index = index;
    f->to_t = to_t;
    f->reference = 0;
    f->top = 1;
    f->waiting[0] = DONE;
    f->distance[0] = -INFINITY;
}

// The next one to visit of those that wait; for the closest hit of those that are not behind it.
static inline int next_waiting(Flight *f, const bool stop_at_first) {
    int top = f->top - 1;
#if INSTANCES
    for (;; --top) {
        while (!stop_at_first && f->distance[top] > f->hit.t) --top;
        if (f->waiting[top] != LEAVE) break;
        f->ray = f->world;
    }
#else
    while (!stop_at_first && f->distance[top] > f->hit.t) --top;
#endif
    f->top = top;
    return f->waiting[top];
}

static inline int visit_node(const Scene *scene, Flight *f, const bool stop_at_first) {
    global const Node *node = scene->nodes + f->reference;
    float8 entry;
    uint entered = enter_boxes(&f->ray.boxes, node->lo[0], f->hit.t, &entry);
    int8 children = vload8(0, node->child);
    int *waiting = f->waiting + f->top;
    if (stop_at_first) {
        store_lanes(children, entered, waiting);
        f->top += popcount(entered);
        return next_waiting(f, true);
    }
    int nearest = least_lane(entry, entered);
    uint others = entered & ~(1u << nearest);
    store_lanes(children, others, waiting);
    store_lanes(as_int8(entry), others, (int *)(f->distance + f->top));
    f->top += popcount(others);
    return entered ? node->child[nearest] : next_waiting(f, false);
}

static inline int visit_leaf(const Scene *scene, Flight *f, const bool stop_at_first) {
#if INSTANCES
    if (in_world(&f->ray)) {
        f->waiting[f->top] = LEAVE;
        f->distance[f->top++] = -INFINITY;
        int root;
        f->ray = enter_instance(scene, &f->world, f->reference, &root);
        return root;
    }
#endif
    hit_leaf(scene, &f->ray.leaf, f->reference, stop_at_first, &f->hit);
    return stop_at_first && f->hit.primitive >= 0 ? DONE : next_waiting(f, stop_at_first);
}
