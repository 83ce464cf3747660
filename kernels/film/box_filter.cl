// Box filter: uniform over the pixel.
#include "core/lanes.cl"

static inline real filter_sample(const Scene *scene, real u) { return u; }
