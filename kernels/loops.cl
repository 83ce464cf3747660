// Drivers that end loops early: Mesa's llvmpipe lets the loops of a work-item take 65535 turns in all, and from then on
// each ends after its first turn, without a word (clrt/device/loops.py). LOOP_LIMIT says that the device's is such a driver.
#if LOOP_LIMIT
// Whether that has happened to this work-item: then what it computed is worth nothing. `two` is 2, which must not be
// known to the compiler, or it would answer by itself.
static inline bool loops_ended(uint two) {
    uint a = 1;
    for (uint turn = 0; turn < two; ++turn) a = 5 * a + 1;
    return a != 31;
}
#else
#define loops_ended(two) false
#endif
