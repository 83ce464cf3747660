// Traversal statistics, counted only in programs whose scene has a buffer for them (clrt/bench/rays/node_visits.py):
// nodes whose children's boxes are tested, and tests of primitives in leaves, each of a triangle or a pack.

#if COUNT_VISITS
#define VISIT(what) atomic_inc((volatile global uint *)&RECORD(scene->visits, 0)->what)
#else
#define VISIT(what)
#endif
