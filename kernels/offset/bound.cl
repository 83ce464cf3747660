// Origins of spawned rays: at the edge of the position's error bound, without an epsilon of scene size (pbrt, 4th ed.,
// 6.8).
#include "core/vector.cl"

// If the error bound of a position is 0, as on a floor at y = 0, it is moved by this fraction of its largest
// coordinate: as much as the rounding of the triangle test, which is exact where that is not enough
// (geometry/triangle_watertight.cl).
#define LEAST (4.0f * UNIT_ROUNDOFF)

// Move p out of its error box along the normal, to the side of `direction`.
static inline real3 offset_origin(real3 p, real3 p_error, real3 ng, real3 direction) {
    real distance = maximum(dot3(absolute3(ng), p_error), LEAST * largest(absolute3(p)));
    return mad3(ng, dot3(direction, ng) < 0.0f ? -distance : distance, p);
}
