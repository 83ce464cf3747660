// Stratified (jittered) samples: the pairs of a block of 2^k samples fall one into each cell of a grid of 2^k cells, in
// a random order per pixel and pair of dimensions (Cook et al. 1984; Kensler 2013, "Correlated Multi-Jittered
// Sampling", for the order).
#include "core/rng.cl"

#define MOST_CELLS_BITS 16   // of a grid
#define DEFAULT_CELLS_BITS 8 // if the number of samples is unknown

typedef struct {
    ureal key, sample;
    uint dimension, cell_bits;
} Sampler;

static inline Sampler sampler_at(ureal pixel, ureal sample, uint seed, uint block_bits) {
    uint bits = block_bits == 32 ? DEFAULT_CELLS_BITS : block_bits < MOST_CELLS_BITS ? block_bits : MOST_CELLS_BITS;
    ureal key = hash4(pixel, sample >> bits, (ureal)(seed), (ureal)(0)).y;
    return (Sampler){key, sample, 0, bits};
}

// A permutation of the numbers of `bits` bits: each step is invertible, and the last makes the result uniform.
static inline ureal shuffled(ureal x, uint bits, ureal4 keys) {
    ureal mask = (ureal)((1u << bits) - 1);
    uint middle = (bits + 1) / 2;
    x = (x ^ keys.x) * (keys.x >> 15 | 1) & mask;
    x ^= x >> middle;
    x = (x ^ keys.y) * (keys.y >> 15 | 1) & mask;
    x ^= x >> middle;
    x = (x ^ keys.z) * (keys.z >> 15 | 1) & mask;
    x ^= x >> middle;
    return (x + keys.w) & mask;
}

static inline ureal2 next_bits(Sampler *sampler) {
    uint bits = sampler->cell_bits, columns = bits / 2, rows = bits - columns;
    ureal4 order = hash4(sampler->key, (ureal)(sampler->dimension), (ureal)(0), (ureal)(1));
    ureal4 words = hash4(sampler->key, (ureal)(sampler->dimension++), sampler->sample, (ureal)(2));
    ureal cell = shuffled(sampler->sample & ((1u << bits) - 1), bits, order);
    ureal column = cell & ((1u << columns) - 1), row = cell >> columns;
    ureal x = words.y >> columns, y = words.z >> rows;
    return (ureal2){columns ? x | column << (32 - columns) : x, rows ? y | row << (32 - rows) : y};
}
