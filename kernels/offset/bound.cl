// Where rays leave a surface: at the edge of the position's error, so no scene-size epsilon exists (pbrt, 4th ed., 6.8).
#include "vector.cl"

// Where a position has no error, as on a floor at y = 0, it is moved this part of its largest coordinate: by as much a
// triangle's test rounds, and in doubt it takes the long way (geometry/triangle_watertight.cl).
#define LEAST (4.0f * UNIT_ROUNDOFF)

// p moved out of its error box along the normal, to the side that `direction` leaves to.
static inline real3 offset_origin(real3 p, real3 p_error, real3 ng, real3 direction) {
    real distance = maximum(dot3(absolute3(ng), p_error), LEAST * largest(absolute3(p)));
    return mad3(ng, dot3(direction, ng) < 0.0f ? -distance : distance, p);
}
