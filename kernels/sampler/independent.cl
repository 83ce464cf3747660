// Independent samples: the error falls as 1/√n. The simplest sampler, for comparison.
#include "core/rng.cl"

typedef struct {
    ureal pixel, sample;
    uint seed, dimension;
} Sampler;

static inline Sampler sampler_at(ureal pixel, ureal sample, uint seed, uint block_bits) {
    return (Sampler){pixel, sample, seed, 0};
}

static inline ureal2 next_bits(Sampler *sampler) {
    ureal4 words = hash4(sampler->pixel, sampler->sample, (ureal)(sampler->dimension++), (ureal)(sampler->seed));
    return (ureal2){words.y, words.z};
}
