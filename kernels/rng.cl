// Random numbers as a function of (pixel, sample, dimension, seed): nothing depends on tiling, order or device.
// The hash is pcg4d (Jarzynski and Olano 2020, "Hash Functions for GPU Rendering", JCGT 9(3)).
#include "lanes.cl"

typedef struct {
    ureal pixel, sample;
    uint seed, dimension;
} Sampler;

static inline real unit_interval(ureal bits) { return TO_REAL(bits >> 8) * 5.9604645e-8f; }  // [0, 1), 24 bits

// The next two dimensions as 32 random bits each.
static inline ureal2 next_bits(Sampler *sampler) {
    ureal x = sampler->pixel * 1664525u + 1013904223u;
    ureal y = sampler->sample * 1664525u + 1013904223u;
    ureal z = (ureal)(sampler->dimension++ * 1664525u + 1013904223u);
    ureal w = (ureal)(sampler->seed * 1664525u + 1013904223u);
    x += y * w; y += z * x; z += x * y; w += y * z;
    x ^= x >> 16; y ^= y >> 16; z ^= z >> 16; w ^= w >> 16;
    x += y * w; y += z * x;
    return (ureal2){x, y};
}

static inline real2 next_2d(Sampler *sampler) {
    ureal2 bits = next_bits(sampler);
    return (real2){unit_interval(bits.x), unit_interval(bits.y)};
}

static inline real next_1d(Sampler *sampler) { return unit_interval(next_bits(sampler).x); }
