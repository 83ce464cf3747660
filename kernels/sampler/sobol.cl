// The first two dimensions of Sobol's sequence, scrambled as Owen does and padded: every pair of dimensions takes the
// same points, in an order and with a scrambling of its own (Burley 2020, "Practical Hash-Based Owen Scrambling", JCGT
// 9(4), with the hash of Laine and Karras 2011 and Vegdahl's constants). The error of a smooth integral falls nearly as
// one over the number of samples, and any 2^k consecutive ones from a multiple of 2^k on are a (0, k, 2)-net.
//
// Pixels of a square take blocks of 2^block_bits points of one sequence along the Z curve, so that those of neighbours
// are stratified together and their errors cancel where eyes and filters average them (Ahmed and Wonka 2020). Each
// square, and each later block, has a sequence of its own: errors of pixels that share one rise and fall together, and
// were that all of them, no change of a picture would tell what its error is (clrt/rendering/noise.py). With
// block_bits = 32, where nobody knows how many samples there will be, each pixel has its own.
#include "rng.cl"

#define SQUARE_BITS 8   // of a pixel's number in its square, unless points of so many pixels are too many for 32 bits

typedef struct {
    ureal reversed_index, key;   // the point's number with its bits reversed; the sequence's key
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

// Flips each bit by a hash of those below it: Owen's scrambling of a number whose bits are reversed.
static inline ureal scrambled(ureal x, ureal key) {
    x ^= x * 0x3d20adeau;
    x += key;
    x *= key >> 16 | 1;
    x ^= x * 0x05526c56u;
    return x ^ x * 0x53a22864u;
}

// The second dimension of the point `index`, its bits reversed, as those of the index itself are the first's: the sum of
// the rows of Pascal's triangle modulo 2 that the index's bits name, which is i(1 + z) for a polynomial i(z).
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
