// Traversal statistics, only in programs whose scene has buffers for them: counts of visits (clrt/bench/rays/
// node_visits.py), or a record of each in the order of a work-item (clrt/bench/simt/record.py).
//
// VISIT(what, index): nodes whose children's boxes are tested (of bvh2, by the first child), leaves of bvh2, tests of
// primitives in leaves, each of a triangle or a pack, spheres (of bvh2, leaves of them) and instances; closest and blocked are rays that enter
// the BVH, segments those of a path, and shading a surface whose material is evaluated.

#if COUNT_VISITS
#define VISIT(what, index) atomic_inc((volatile global uint *)&RECORD(scene->visits, 0)->what)
#elif RECORD_VISITS
enum { VISIT_nodes, VISIT_leaves, VISIT_tests, VISIT_spheres, VISIT_instances, VISIT_closest, VISIT_blocked,
       VISIT_segments, VISIT_shading };

// Append a word to the work-item's part of the record; past its end words are only counted.
static inline void record_visit(const Scene *scene, uint kind, uint index) {
    global VisitRange *range = (global VisitRange *)RECORD(scene->visit_ranges, get_global_id(0));
    uint at = range->next++;
    if (at < range->end) ((global VisitWord *)RECORD(scene->visit_words, at))->word = kind << 28 | index;
}
#define VISIT(what, index) record_visit(scene, VISIT_##what, (uint)(index))
#else
#define VISIT(what, index)
#endif
