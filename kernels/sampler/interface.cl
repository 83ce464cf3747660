// The interface of a sampler; each sampler's file provides
//
//   Sampler, with a member `dimension`                      the dimension of the next pair, from 0
//   sampler_at(pixel, sample, seed, block_bits)             the sampler of one sample of a pixel, with a unique number
//   next_bits(&sampler)                                     the next pair, 32 bits each
//
// Samples come in blocks of 2^block_bits, each of which covers the unit square evenly; 32: a single block.
#include "core/rng.cl"
#include SAMPLER

static inline real2 next_2d(Sampler *sampler) {
    ureal2 bits = next_bits(sampler);
    return (real2){unit_interval(bits.x), unit_interval(bits.y)};
}

static inline real next_1d(Sampler *sampler) { return unit_interval(next_bits(sampler).x); }

static inline ureal spread_bits(ureal x) {
    x = (x | x << 8) & 0x00ff00ffu;
    x = (x | x << 4) & 0x0f0f0f0fu;
    x = (x | x << 2) & 0x33333333u;
    return (x | x << 1) & 0x55555555u;
}

// The pixel's index on the Z curve (Morton 1966): unique, and close for neighbours.
static inline ureal pixel_code(ureal x, ureal y) { return spread_bits(x) | spread_bits(y) << 1; }
