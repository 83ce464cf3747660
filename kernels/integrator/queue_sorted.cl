// Order of the stage `shade` in scenes with microfacet materials: by kind, i.e. misses and the material types, so that
// a work-group shades hits of one kind.
//
// block_count(q, depth)                the number of blocks, of one entry per work-item of a group, to shade
// entry_of(q, depth, block, &i)        the place in the queue of this work-item's entry; false if it has none

static inline uint blocks_of_kind(const Queues *q, int depth, uint kind) {
    return (queued_hits(q, depth)[kind] + (uint)get_local_size(0) - 1) / (uint)get_local_size(0);
}

static inline uint block_count(const Queues *q, int depth) {
    uint blocks = 0;
    for (uint kind = 0; kind < KINDS; ++kind) blocks += blocks_of_kind(q, depth, kind);
    return blocks;
}

static inline bool entry_of(const Queues *q, int depth, uint block, uint *i) {
    uint kind = 0;
    for (uint blocks; block >= (blocks = blocks_of_kind(q, depth, kind)); ++kind) block -= blocks;
    uint place = block * (uint)get_local_size(0) + (uint)get_local_id(0);
    bool used = place < queued_hits(q, depth)[kind];
    *i = used ? q->order[kind * q->capacity + place] : 0;
    return used;
}

// The material code of the primitive that was hit.
static inline int material_code(const Scene *scene, const Hits *hits) {
    int primitive = hits->primitive;
#if INSTANCES
    primitive += RECORD(scene->placements, hits->instance)->first;
#endif
#if SPHERES
#if TRIANGLES
    if (primitive >= scene->counts.triangles)
#endif
        return RECORD(scene->spheres, primitive - scene->counts.triangles)->material;
#endif
#if TRIANGLES
#if INSTANCES
    int own = RECORD(scene->placements, hits->instance)->material;
    if (own >= 0) return own;
#endif
    return RECORD(scene->triangles, primitive)->material;
#endif
}

static inline uint kind_of(const Scene *scene, const Hits *hits) {
    if (hits->primitive < 0) return 0;
    int type = material_code(scene, hits) & 15;
    uint kind = 0, next = 1;
#define FIND_KIND(name, number) if (type == number) kind = next; ++next;
    MATERIAL_TYPES(FIND_KIND)
    return kind;
}

// Stage 3: sort the hits by kind.
kernel void sort_hits(SCENE_PARAMETERS, QUEUE_PARAMETERS, const int depth) {
    local uint group[2 * KINDS];
    Scene scene = SCENE_ARGUMENTS;
    const Queues q = QUEUE_ARGUMENTS;
    uint count = *queued_paths(&q, depth);
    for (uint first = get_group_id(0) * get_local_size(0); first < count; first += get_global_size(0)) {
        uint i = first + get_local_id(0), kind = KINDS;
        if (i < count) {
            Hits hits = load_hits(&q, i);
            kind = kind_of(&scene, &hits);
        }
        uint place = reserve(queued_hits(&q, depth), KINDS, kind, group);
        if (kind < KINDS) q.order[kind * q.capacity + place] = i;
    }
}
