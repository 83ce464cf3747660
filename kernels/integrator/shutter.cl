// The time of samples, in scenes in which something moves: a fraction s of the exposure of the whole image, in which the
// shutter of a row opens row_share·y/height after that of the first and stays open for open_share.
//
// It is a number of its own of each sample, in a dimension that nothing else uses, so stages need not store it: SET_TIME
// (integrator/camera_rays.cl) sets that of a scene, scene->time, which everything that traces or shades reads there.
#define TIME_DIMENSION 0x74696d65u

static inline real time_of(const Launch *launch, ureal y, real u) {
    return minimum(fma((real)(launch->open_share), u, launch->row_share * (TO_REAL(y) / (float)launch->height)), ONE);
}

static inline real sample_time(const Launch *launch, const Sampler *sampler, ureal y) {
    Sampler own = *sampler;
    own.dimension = TIME_DIMENSION;
    return time_of(launch, y, next_1d(&own));
}
