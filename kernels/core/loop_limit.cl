// Detection of drivers that end loops early: Mesa's llvmpipe limits the loops of a work-item to 65535 iterations in
// total; after that each loop silently ends after its first iteration (clrt/device/launches/driver_loop_limits.py).
// LOOP_LIMIT: the driver is one of these.
#if LOOP_LIMIT
// 2, which the compiler must not know: it would fold the loop below. number: one that is known at run time alone, and
// never the largest uint, which the compiler cannot know either.
#define HIDDEN_TWO(number) (2 + ((number) == 0xffffffff))

// Whether that has happened to this work-item, which invalidates its results. number: see HIDDEN_TWO.
static inline bool loops_ended(uint number) {
    uint a = 1;
    for (uint turn = 0, turns = HIDDEN_TWO(number); turn < turns; ++turn) a = 5 * a + 1;
    return a != 31;
}
#else
#define loops_ended(number) false
#endif
