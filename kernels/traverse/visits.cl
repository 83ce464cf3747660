// What rays visit is counted in programs whose scene has a buffer to count in (clrt/study/visits.py), elsewhere not:
// nodes whose children's boxes are met, and tests of what is in leaves, be it a triangle or a pack.

#if COUNT_VISITS
#define VISIT(what) atomic_inc((volatile global uint *)&RECORD(scene->visits, 0)->what)
#else
#define VISIT(what)
#endif
