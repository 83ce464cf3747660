// Order of the stage `shade` in scenes without microfacet materials: that of the queue. See integrator/queue_sorted.cl.
static inline uint block_count(const Queues *q, int depth) {
    return (*queued_paths(q, depth) + (uint)get_local_size(0) - 1) / (uint)get_local_size(0);
}

static inline bool entry_of(const Queues *q, int depth, uint block, uint *i) {
    *i = block * (uint)get_local_size(0) + (uint)get_local_id(0);
    return *i < *queued_paths(q, depth);
}
