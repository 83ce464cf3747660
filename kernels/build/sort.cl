// Stable radix sort of codes with their indices, eight bits per pass, without atomics.
//
// Each work-item counts the digits of its block; the counts, by digit and then by block, are scanned into offsets; then
// each work-item moves its block to them in order.
#include "build/scan.cl"

#define DIGITS 256

kernel void count_digits(uint count, uint block, global const ulong *codes, uint shift, global uint *counts) {
    uint me = get_global_id(0), blocks = (count + block - 1) / block;
    if (me >= blocks) return;
    uint first = me * block, end = first + block < count ? first + block : count;
    uint digits[DIGITS];
    for (int d = 0; d < DIGITS; ++d) digits[d] = 0;
    for (uint i = first; i < end; ++i) ++digits[(uint)(codes[i] >> shift) & (DIGITS - 1)];
    for (int d = 0; d < DIGITS; ++d) counts[d * blocks + me] = digits[d];
}

kernel void move_digits(uint count, uint block, global const ulong *codes, global const uint *order, uint shift,
                        global const uint *places, global ulong *sorted_codes, global uint *sorted_order) {
    uint me = get_global_id(0), blocks = (count + block - 1) / block;
    if (me >= blocks) return;
    uint first = me * block, end = first + block < count ? first + block : count;
    uint place[DIGITS];
    for (int d = 0; d < DIGITS; ++d) place[d] = places[d * blocks + me];
    for (uint i = first; i < end; ++i) {
        uint to = place[(uint)(codes[i] >> shift) & (DIGITS - 1)]++;
        sorted_codes[to] = codes[i];
        sorted_order[to] = order[i];
    }
}
