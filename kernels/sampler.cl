// Where the numbers of a sample come from. Each sampler's file provides
//
//   Sampler, with a member `dimension`                      the next pair's, from 0
//   sampler_at(pixel, sample, seed, block_bits)             of sample `sample` of a pixel; pixel: any number of its own
//   next_bits(&sampler)                                     the next pair, 32 bits each
//
// Its sample numbers come in blocks of 2^block_bits, each of which fills the square evenly; 32: there is but one block.
#include "rng.cl"
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

// The pixel's place along the Z curve (Morton 1966): neighbours are close, and each pixel's number is its own.
static inline ureal pixel_code(ureal x, ureal y) { return spread_bits(x) | spread_bits(y) << 1; }
