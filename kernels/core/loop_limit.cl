// Detection of drivers that end loops early: Mesa's llvmpipe limits the loops of a work-item to 65535 iterations in
// total; after that each loop silently ends after its first iteration (clrt/device/launches/driver_loop_limits.py).
// LOOP_LIMIT: the driver is one of these.
#if LOOP_LIMIT
// Whether that has happened to this work-item, which invalidates its results. `two` is 2, but must be unknown to the
// compiler, which would otherwise fold the loop.
static inline bool loops_ended(uint two) {
    uint a = 1;
    for (uint turn = 0; turn < two; ++turn) a = 5 * a + 1;
    return a != 31;
}
#else
#define loops_ended(two) false
#endif
