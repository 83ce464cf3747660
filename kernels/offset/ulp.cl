// Origins of spawned rays: an offset of some ulps along the normal, near the coordinates' origin a fixed distance
// (Wächter and Binder 2019, "A Fast and Robust Method for Avoiding Self-Intersection", Ray Tracing Gems, ch. 6, with
// its constants).
//
// An ulp grows with the coordinate in steps, as its rounding does; the primitive's size, on which the error depends, is
// ignored. SCENE_UNIT is the scene's unit of length.
#include "core/vector.cl"

#define ULPS 256.0f
#define NEAR_ZERO (SCENE_UNIT / 32.0f)
#define FIXED_STEP (SCENE_UNIT / 65536.0f)

static inline real step_ulps(real p, real n) {
    ireal ulps = TO_INT(ULPS * n);
    real stepped = AS_REAL(AS_INT(p) + (p < 0.0f ? -ulps : ulps));
    return absolute(p) < NEAR_ZERO ? p + FIXED_STEP * n : stepped;
}

// Move p along the normal, to the side of `direction`.
static inline real3 offset_origin(real3 p, real3 p_error, real3 ng, real3 direction) {
    real3 n = choose(dot3(direction, ng) < 0.0f, negate(ng), ng);
    return vector(step_ulps(p.x, n.x), step_ulps(p.y, n.y), step_ulps(p.z, n.z));
}
