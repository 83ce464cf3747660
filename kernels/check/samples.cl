// Random numbers and sums of samples, for the host to compare with exact results.
#include "check/rows.cl"
#include "film/film.cl"
#include "sampler/interface.cl"

// in: pixel, sample. out: the bits of two dimensions, then the numbers made from them
kernel void numbers(uint count, uint block, global const ureal *in, uint seed, uint dimension, global ureal *bits,
                    global real *units) {
    FOR_BLOCK(i) {
        Sampler sampler = sampler_at(in[i], in[count + i], seed, 32);
        sampler.dimension = dimension;
        ureal2 drawn = next_bits(&sampler);
        bits[i] = drawn.x;
        bits[count + i] = drawn.y;
        units[i] = unit_interval(drawn.x);
        units[count + i] = unit_interval(drawn.y);
    }
}

// in: `samples` rows of radiance. out: sum, its error, sum of squares, its error; then the numbers kept and dropped
kernel void sums(uint count, uint block, global const real *in, uint samples, global real *out, global ureal *counts) {
    FOR_BLOCK(i) {
        Accumulator a = {splat(ZERO), splat(ZERO), splat(ZERO), splat(ZERO), (ureal)(0), (ureal)(0), (ureal)(0)};
        for (uint s = 0; s < samples; ++s) accumulate(&a, splat(in[s * count + i]), ALL_LANES);
        out[i] = a.sum.x;
        out[count + i] = a.sum_error.x;
        out[2 * count + i] = a.square.x;
        out[3 * count + i] = a.square_error.x;
        counts[i] = a.count;
        counts[count + i] = a.dropped;
    }
}
