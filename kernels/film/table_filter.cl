// Tabulated filter, sampled by its quantiles, so that all samples have equal weight (Ernst, Stamminger and Greiner
// 2006, "Filter Importance Sampling"). Positions are in pixels from the pixel's left or upper edge.
#include "core/lanes.cl"

#define FILTER_CELLS 1024

static inline real filter_sample(const Scene *scene, real u) {
    real place = u * (float)FILTER_CELLS;
    ireal cell = TO_INT(place);
    real low = GATHER(real, scene->filter, cell, .quantile), high = GATHER(real, scene->filter, cell + 1, .quantile);
    return low + (place - TO_REAL(cell)) * (high - low);
}
