// The masks of eight lanes used in BVH traversal (core/mask.cl). Each i has three rows of eight: the lanes' masks of a
// < b; the set lanes of a, compressed, then −1; the mask's bits, their number and the first of them, the lane with the
// smallest b among them, and the bits of sixteen lanes, of which the upper eight are the complement.
#include "check/rows.cl"

// in: a, b, eight of each; b >= 0
kernel void masks(uint count, uint block, global const float8 *in, global int8 *out) {
    FOR_BLOCK(i) {
        float8 a = in[i], b = in[count + i];
        int8 mask = a < b;
        uint bits = mask_bits(mask), ones = popcount(bits);
        int stored[8];
        store_lanes(as_int8(a), bits, stored);
        for (uint k = ones; k < 8; ++k) stored[k] = -1;
        out[i] = mask;
        out[count + i] = vload8(0, stored);
        out[2 * count + i] = (int8)((int)bits, (int)ones, bits ? first_bit(bits) : -1, least_lane(b, mask),
                                    (int)mask_bits16((int16)(mask, ~mask)), 0, 0, 0);
    }
}
