// Many rays in flight per work-item, for the layout bvh8 on CPUs with high memory latency.
//
// POOL rays take turns, one step each: a node or a leaf. While the others take theirs, the data that a ray needs next
// is prefetched. A finished ray is replaced by the next one. Steps are branchless if possible; rays at nodes and rays
// at leaves are listed separately, to avoid branch mispredictions.
#include "geometry/boxes.cl"
#include "traverse/bvh8.cl"

#define DONE 0x7fffffff

typedef struct { LeafRays leaves; BoxRays boxes; } FlightRays;   // of all lanes
typedef struct { BoxRay boxes; LeafRay leaf; } FlightRay;

static inline FlightRays flight_rays(real3 origin, real3 direction) {
    return (FlightRays){leaf_rays(origin, direction), box_rays(origin, direction)};
}

static inline FlightRay flight_ray(const FlightRays *rays, const Ray *ray, int lane) {
    return (FlightRay){box_ray(&rays->boxes, lane), leaf_ray(&rays->leaves, ray, lane)};
}

static inline void fetch(const Scene *scene, int reference) {
    global const void *record = RECORD(scene->nodes, reference);
    uint last_line = sizeof(Node) - 64;
#if TRIANGLES
    record = reference < 0 ? (global const void *)RECORD(scene->packs, ~reference >> 4) : record;
    last_line = reference < 0 ? sizeof(Triangles) - 64 : last_line;   // a pack has one more cache line
#endif
#if LEAF_SPHERES
    record = reference < 0 && (~reference & 8) ? (global const void *)RECORD(scene->leaf_spheres, ~reference >> 4) : record;
#endif
    PREFETCH(record, sizeof(Node))
    PREFETCH((global const char *)record + last_line, 64)
}

typedef struct {
    FlightRay ray;
    Hit hit;
    int reference, top;
    uint index;     // index of the ray in the host's arrays, and the factor of its t
    float to_t;
#if INSTANCES
    FlightRay world;
#endif
    int waiting[1 + STACK_SIZE + 8];   // the first is DONE, at distance −∞; store_lanes may overwrite eight more
    float distance[1 + STACK_SIZE + 8];
} Flight;

static inline void take_off(Flight *f, const FlightRays *rays, const Ray *ray, int lane, uint index, float to_t) {
    f->ray = flight_ray(rays, ray, lane);
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

// Pop the next entry from the stack; for the closest hit, skip those behind it.
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
    VISIT(nodes, f->reference);
    global const Node *node = RECORD(scene->nodes, f->reference);
    float8 entry;
    int8 mask = enter_eight(&f->ray.boxes, node->lo[0], f->hit.t, &entry);
    uint entered = mask_bits(mask);
    int8 children = vload8(0, node->child);
    int top = f->top;
    if (stop_at_first) {
        store_lanes(children, entered, f->waiting + top);
        f->top = top + (int)popcount(entered);
        return next_waiting(f, true);
    }
    int nearest = least_lane(entry, mask);
    uint others = entered & ~(1u << nearest);
    store_lanes(children, others, f->waiting + top);
    store_lanes(as_int8(entry), others, (int *)(f->distance + top));
    f->top = top + (int)popcount(others);
    return entered ? node->child[nearest] : next_waiting(f, false);
}

static inline int visit_leaf(const Scene *scene, Flight *f, const bool stop_at_first) {
#if INSTANCES
    if (f->ray.leaf.ray.instance == IN_WORLD) {
        Ray object = object_ray(scene, &f->world.leaf.ray, ~f->reference >> 4);
        FlightRays rays = flight_rays(broadcast(object.origin), broadcast(object.direction));
        f->ray = flight_ray(&rays, &object, 0);
        f->waiting[f->top] = LEAVE;
        f->distance[f->top++] = -INFINITY;
        return RECORD(scene->instances, object.instance)->root;
    }
#endif
    hit_leaf(scene, &f->ray.leaf, f->reference, stop_at_first, &f->hit);
    return stop_at_first && f->hit.primitive >= 0 ? DONE : next_waiting(f, stop_at_first);
}
