// Origins of spawned rays: a fixed offset of a thousandth of a unit of length, as in textbooks. Too small if
// coordinates are large, too large if the scene is small. SCENE_UNIT is the scene's unit of length.
#include "core/vector.cl"

#define EPSILON (1e-3f * SCENE_UNIT)

// Move p along the normal, to the side of `direction`.
static inline real3 offset_origin(real3 p, real3 p_error, real3 ng, real3 direction) {
    return mad3(ng, dot3(direction, ng) < 0.0f ? (real)(-EPSILON) : (real)(EPSILON), p);
}
