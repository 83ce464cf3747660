// Where rays leave a surface: at the edge of the position's error, so no scene-size epsilon exists (pbrt, 4th ed., 6.8).
#include "vector.cl"

// p moved out of its error box along the normal, to the side that `direction` leaves to.
static inline real3 offset_origin(real3 p, real3 p_error, real3 ng, real3 direction) {
    real distance = dot3(absolute3(ng), p_error);
    return mad3(ng, dot3(direction, ng) < 0.0f ? -distance : distance, p);
}
