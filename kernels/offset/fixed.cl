// Where rays leave a surface: a thousandth of a length away, whatever the scene's size, as in textbooks. Too little where
// coordinates are large, too much where the scene is small. SCENE_UNIT is a scene's unit of length.
#include "vector.cl"

#define EPSILON (1e-3f * SCENE_UNIT)

// p moved along the normal, to the side that `direction` leaves to.
static inline real3 offset_origin(real3 p, real3 p_error, real3 ng, real3 direction) {
    return mad3(ng, dot3(direction, ng) < 0.0f ? (real)(-EPSILON) : (real)(EPSILON), p);
}
