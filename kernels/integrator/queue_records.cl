// Queues of path tracing on GPUs: records as structure of arrays, rows of four words, which neighbouring work-items
// read and write together. A slot is a sample of the launch: its number is sample · pixel_count + pixel.
//
// QUEUE_PARAMETERS, QUEUE_ARGUMENTS   the queues as a kernel's parameters, and as a Queues
//
// lengths: for each depth from 1 on, the number of paths and of shadow rays and, if SORT_HITS, of hits of each kind. Of
// depth 0 only the first is used: it is set if the driver ended loops.
#include "core/loop_limit.cl"
#include "integrator/path_segment.cl"

#define SHADOWS (PRIMITIVES && LIGHTS)
#if ATTENUATION || GUIDING
#define PATH_ROWS 6
#else
#define PATH_ROWS 5
#endif
#if SORT_HITS
#define ADD_ONE(name, number) + 1
#define KINDS (1 MATERIAL_TYPES(ADD_ONE))   // misses, and hits by material type
#else
#define KINDS 0
#endif

typedef struct {
    global uint *lengths;
    global float4 *paths, *hits, *shadows;
    global int *instances;
    global uint *order;  // by kind: the places of its hits
    global float *light;
    global uint *rays;   // by slot
    uint capacity;       // of each queue
} Queues;

#define QUEUE_PARAMETERS global uint *queue_lengths, global float4 *path_queue, global float4 *hit_queue, \
                         global int *instance_queue, global uint *hit_order, global float4 *shadow_queue, \
                         global float *light_of_slots, global uint *rays_of_slots, const uint capacity
#define QUEUE_ARGUMENTS {queue_lengths, path_queue, hit_queue, shadow_queue, instance_queue, hit_order, \
                         light_of_slots, rays_of_slots, capacity}

static inline global uint *queued_paths(const Queues *q, int depth) { return q->lengths + (2 + KINDS) * depth; }
static inline global uint *queued_shadows(const Queues *q, int depth) { return queued_paths(q, depth) + 1; }
static inline global uint *queued_hits(const Queues *q, int depth) { return queued_paths(q, depth) + 2; }

// Reserve a place for every work-item in the queue of its kind, of `kinds` queues; none if kind >= kinds. One atomic
// operation per work-group and queue; all work-items of the group must call it. group: 2 · kinds words of local memory.
static inline uint reserve(global uint *lengths, uint kinds, uint kind, local uint *group) {
    local uint *firsts = group + kinds;
    for (uint k = get_local_id(0); k < kinds; k += get_local_size(0)) group[k] = 0;
    barrier(CLK_LOCAL_MEM_FENCE);
    uint place = kind < kinds ? atomic_inc(&group[kind]) : 0;
    barrier(CLK_LOCAL_MEM_FENCE);
    for (uint k = get_local_id(0); k < kinds; k += get_local_size(0)) firsts[k] = atomic_add(&lengths[k], group[k]);
    barrier(CLK_LOCAL_MEM_FENCE);
    return kind < kinds ? firsts[kind] + place : 0;
}

static inline uint reserve_if(bool appends, global uint *length, local uint *group) {
    return reserve(length, 1, appends ? 0 : 1, group);
}

// A path between stages. Paths of even and odd depths have their own rows.
typedef struct {
    Path path;
    uint slot, dimension, rays;   // rays: traced so far
} Travel;

// The word of a path's rays and flags.
#if CLEAR_GLASS
#define FLAGS 2
#define RAYS_WORD(t) t->rays << FLAGS | (uint)(t->path.clear != 0) << 1 | (uint)(t->path.specular != 0)
#else
#define FLAGS 1
#define RAYS_WORD(t) t->rays << FLAGS | (uint)(t->path.specular != 0)
#endif

static inline float4 row_of(real3 vector, float last) { return (float4)(vector.x, vector.y, vector.z, last); }
static inline real3 xyz(float4 row) { return vector(row.x, row.y, row.z); }

static inline global float4 *path_rows(const Queues *q, int depth, uint place) {
    return q->paths + (depth & 1) * PATH_ROWS * q->capacity + place;
}

static inline void store_path(const Queues *q, int depth, uint place, const Travel *t) {
    global float4 *row = path_rows(q, depth, place);
    row[0] = row_of(t->path.origin, as_float(t->slot));
    row[q->capacity] = row_of(t->path.wi, as_float(t->dimension));
    row[2 * q->capacity] = row_of(t->path.p, t->path.pdf);
    row[3 * q->capacity] = row_of(t->path.n, as_float(RAYS_WORD(t)));
#if TRANSMISSION
    row[4 * q->capacity] = row_of(t->path.beta, t->path.spread);
#else
    row[4 * q->capacity] = row_of(t->path.beta, 0.0f);
#endif
#if ATTENUATION && GUIDING
    row[5 * q->capacity] = row_of(t->path.absorption, t->path.expected);
#elif ATTENUATION
    row[5 * q->capacity] = row_of(t->path.absorption, 0.0f);
#elif GUIDING
    row[5 * q->capacity].w = t->path.expected;
#endif
}

static inline Travel load_path(const Queues *q, int depth, uint place) {
    global const float4 *row = path_rows(q, depth, place);
    float4 origin = row[0], wi = row[q->capacity], p = row[2 * q->capacity], n = row[3 * q->capacity];
    float4 beta = row[4 * q->capacity];
    Travel t;
    t.path.origin = xyz(origin);
    t.slot = as_uint(origin.w);
    t.path.wi = xyz(wi);
    t.dimension = as_uint(wi.w);
    t.path.p = xyz(p);
    t.path.pdf = p.w;
    t.path.n = xyz(n);
    t.path.specular = as_int(n.w) & 1;
    t.rays = as_uint(n.w) >> FLAGS;
#if CLEAR_GLASS
    t.path.clear = as_int(n.w) >> 1 & 1;
#endif
    t.path.beta = xyz(beta);
#if TRANSMISSION
    t.path.spread = beta.w;
#endif
#if ATTENUATION
    t.path.absorption = xyz(row[5 * q->capacity]);
#endif
#if GUIDING
    t.path.expected = row[5 * q->capacity].w;
#endif
    return t;
}

static inline void store_hits(const Queues *q, uint place, const Hits *hits) {
    q->hits[place] = (float4)(hits->t, hits->u, hits->v, as_float(hits->primitive));
#if INSTANCES
    q->instances[place] = hits->instance;
#endif
}

static inline Hits load_hits(const Queues *q, uint place) {
    float4 row = q->hits[place];
    Hits hits = {row.x, row.y, row.z, as_int(row.w), 0};
#if INSTANCES
    hits.instance = q->instances[place];
#endif
    return hits;
}

#if SHADOWS
static inline void store_shadow(const Queues *q, uint place, const ShadowRay *ray, uint slot) {
    global float4 *row = q->shadows + place;
#if OPACITY || EMITTER_GROUPS
    int light = ray->light;
#else
    int light = -1;
#endif
    row[0] = row_of(ray->origin, as_float(slot));
    row[q->capacity] = row_of(ray->target, as_float(ray->infinite));
    row[2 * q->capacity] = row_of(ray->wi, as_float(light));
    row[3 * q->capacity] = row_of(ray->contribution, 0.0f);
}

#if MOTION
// The time of a shadow ray (integrator/shutter.cl).
static inline global float *shadow_time(const Queues *q, uint place) {
    return (global float *)(q->shadows + place + 3 * q->capacity) + 3;
}
#endif

static inline ShadowRay load_shadow(const Queues *q, uint place, uint *slot) {
    global const float4 *row = q->shadows + place;
    float4 origin = row[0], target = row[q->capacity], wi = row[2 * q->capacity];
    ShadowRay ray;
    ray.origin = xyz(origin);
    *slot = as_uint(origin.w);
    ray.target = xyz(target);
    ray.infinite = as_int(target.w);
    ray.wi = xyz(wi);
#if OPACITY || EMITTER_GROUPS
    ray.light = as_int(wi.w);
#endif
    ray.contribution = xyz(row[3 * q->capacity]);
    return ray;
}
#endif

// The light of a slot: three rows of one word, three of its direct light, one of the energy removed by clamping, one of
// its coverage, one that is 1 if the camera sees a catcher, and three of the light of each light group.
#define DIRECT_ROW 3
#if DIRECT_LIGHT
#define REMOVED_ROW 6
#else
#define REMOVED_ROW 3
#endif
#if CLAMP
#define ALPHA_ROW (REMOVED_ROW + 1)
#else
#define ALPHA_ROW REMOVED_ROW
#endif
#if ALPHA
#define CAUGHT_ROW (ALPHA_ROW + 1)
#else
#define CAUGHT_ROW ALPHA_ROW
#endif
#if CATCHER
#define GROUPS_ROW (CAUGHT_ROW + 1)
#else
#define GROUPS_ROW CAUGHT_ROW
#endif
#if EMITTER_GROUPS
#define LIGHT_ROWS (GROUPS_ROW + 3 * GROUPS)
#else
#define LIGHT_ROWS GROUPS_ROW
#endif

static inline real3 slot_light(const Queues *q, uint slot, uint row) {
    global const float *at = q->light + slot;
    return vector(at[row * q->capacity], at[(row + 1) * q->capacity], at[(row + 2) * q->capacity]);
}

static inline void store_light(const Queues *q, uint slot, uint row, real3 light) {
    global float *at = q->light + slot;
    at[row * q->capacity] = light.x;
    at[(row + 1) * q->capacity] = light.y;
    at[(row + 2) * q->capacity] = light.z;
}

static inline void clear_slot(const Queues *q, uint slot) {
    q->rays[slot] = 0;
    for (uint row = 0; row < LIGHT_ROWS; ++row) q->light[slot + row * q->capacity] = 0.0f;
}

// Add the contribution of a path of `edges` segments to its slot, which only this work-item uses. Direct light is that
// of at most two segments. Returns what it added.
static inline real3 add_light(const Queues *q, const Launch *launch, uint slot, real3 found, int edges) {
    real removed = ZERO;
    real3 light = clamped(launch, found, edges, &removed);
    // Added if NaN, which the film drops.
    if (!((light.x != 0.0f) | (light.y != 0.0f) | (light.z != 0.0f))) return light;
    store_light(q, slot, 0, add(slot_light(q, slot, 0), light));
#if DIRECT_LIGHT
    if (edges <= 2) store_light(q, slot, DIRECT_ROW, add(slot_light(q, slot, DIRECT_ROW), light));
#endif
#if CLAMP
    q->light[slot + REMOVED_ROW * q->capacity] += removed;
#endif
    return light;
}

#if EMITTER_GROUPS
// Add light to that of a light group.
static inline void add_group_light(const Queues *q, uint slot, int group, real3 light) {
    if (!((light.x != 0.0f) | (light.y != 0.0f) | (light.z != 0.0f))) return;
    uint row = GROUPS_ROW + 3 * group;
    store_light(q, slot, row, add(slot_light(q, slot, row), light));
}
#endif

// Record that the driver ended loops of this work-item early. number: see loops_ended.
static inline void check_loops(const Queues *q, uint number) {
#if LOOP_LIMIT
    if (loops_ended(number)) atomic_or(q->lengths, 1u);
#endif
}
