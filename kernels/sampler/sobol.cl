// Padded (0, 2)-sequences: the first two dimensions of the Sobol' sequence, Owen-scrambled; every pair of dimensions
// uses the same points with its own order and scrambling (Burley 2020, "Practical Hash-Based Owen Scrambling", JCGT
// 9(4), with the hash of Laine and Karras 2011 and Vegdahl's constants). The error of a smooth integral falls nearly as
// 1/n, and any 2^k consecutive samples starting at a multiple of 2^k are a (0, k, 2)-net.
//
// The pixels of a square take blocks of 2^block_bits points of one sequence along the Z curve, so that neighbouring
// pixels are stratified together and their errors cancel when the eye or a filter averages them (Ahmed and Wonka 2020).
// Each square, and each later block, has its own sequence: the errors of pixels that share a sequence are correlated,
// and if all pixels did, changes of the image would not reveal its error
// (clrt/rendering/error_estimate/error_estimate.py). With block_bits = 32, for an unknown number of samples, each
// pixel has its own sequence.
#include "core/rng.cl"

#define SQUARE_BITS 8   // of a pixel's index in its square, unless the points of that many pixels exceed 32 bits

typedef struct {
    ureal reversed_index, key;   // the point's index with its bits reversed; the sequence's key
    uint dimension;
} Sampler;

static inline ureal reverse_bits(ureal x) {
    x = x >> 16 | x << 16;
    x = (x >> 8 & 0x00ff00ffu) | (x & 0x00ff00ffu) << 8;
    x = (x >> 4 & 0x0f0f0f0fu) | (x & 0x0f0f0f0fu) << 4;
    x = (x >> 2 & 0x33333333u) | (x & 0x33333333u) << 2;
    return (x >> 1 & 0x55555555u) | (x & 0x55555555u) << 1;
}

static inline Sampler sampler_at(ureal pixel, ureal sample, uint seed, uint block_bits) {
    ureal index = sample, sequence = pixel, block = (ureal)(0);
    if (block_bits < 32) {
        uint shared = SQUARE_BITS < 32 - block_bits ? SQUARE_BITS : 32 - block_bits;
        index = (pixel & ((1u << shared) - 1)) << block_bits | (sample & ((1u << block_bits) - 1));
        sequence = pixel >> shared;
        block = sample >> block_bits;
    }
    return (Sampler){reverse_bits(index), hash4(sequence, block, (ureal)(seed), (ureal)(0)).y, 0};
}

// Owen scrambling of a bit-reversed number: flip each bit by a hash of the lower bits.
static inline ureal scrambled(ureal x, ureal key) {
    x ^= x * 0x3d20adeau;
    x += key;
    x *= key >> 16 | 1;
    x ^= x * 0x05526c56u;
    return x ^ x * 0x53a22864u;
}

// The bit-reversed second dimension of the point `index` (the first is the index itself): the sum modulo 2 of the rows
// of Pascal's triangle selected by the index's bits, which is i(1 + z) for a polynomial i(z).
static inline ureal second_dimension(ureal index) {
    index ^= index >> 16;
    index ^= (index & 0xff00ff00u) >> 8;
    index ^= (index & 0xf0f0f0f0u) >> 4;
    index ^= (index & 0xccccccccu) >> 2;
    return index ^ (index & 0xaaaaaaaau) >> 1;
}

static inline ureal2 next_bits(Sampler *sampler) {
    ureal4 keys = hash4(sampler->key, (ureal)(sampler->dimension++), (ureal)(0), (ureal)(1));
    ureal index = reverse_bits(scrambled(sampler->reversed_index, keys.y));
    return (ureal2){reverse_bits(scrambled(index, keys.z)), reverse_bits(scrambled(second_dimension(index), keys.w))};
}
