// Stable radix sort of codes with their indices, eight bits per pass.
//
// Each work-group counts the digits of its tile; the counts, by digit and then by tile, are scanned into offsets; then
// each work-group moves its tile to them in order, as many items at a time as it has work-items.
#include "build/scan.cl"
#include "build/tiles.cl"

#define DIGITS 256
#define DIGIT(code) ((uint)((code) >> shift) & (DIGITS - 1))
// A single work-item needs no atomics, which are slow on CPUs.
static inline void count_one(local uint *counter, uint items) {
    if (items == 1) ++*counter;
    else atomic_inc(counter);
}

kernel void count_digits(uint count, uint block, global const ulong *codes, uint shift, global uint *counts) {
    local uint digits[DIGITS];
    TILE_RANGE
    for (uint d = me; d < DIGITS; d += items) digits[d] = 0;
    barrier(CLK_LOCAL_MEM_FENCE);
    for (uint i = first + me; i < end; i += items) count_one(digits + DIGIT(codes[i]), items);
    barrier(CLK_LOCAL_MEM_FENCE);
    for (uint d = me; d < DIGITS; d += items) counts[d * tiles + tile] = digits[d];
}

kernel void move_digits(uint count, uint block, global const ulong *codes, global const uint *order, uint shift,
                        global const uint *places, global ulong *sorted_codes, global uint *sorted_order) {
    local uint place[DIGITS];
    local uint digits[TILE_ITEMS];
    TILE_RANGE
    for (uint d = me; d < DIGITS; d += items) place[d] = places[d * tiles + tile];
    barrier(CLK_LOCAL_MEM_FENCE);
    for (uint start = first; start < end; start += items) {
        uint i = start + me;
        bool here = i < end;
        ulong code = here ? codes[i] : 0;
        uint digit = here ? DIGIT(code) : DIGITS, before = 0;
        digits[me] = digit;
        barrier(CLK_LOCAL_MEM_FENCE);
        for (uint k = 0; k < me; ++k) before += digits[k] == digit;
        if (here) {
            uint to = place[digit] + before;
            sorted_codes[to] = code;
            sorted_order[to] = order[i];
        }
        barrier(CLK_LOCAL_MEM_FENCE);
        if (here) count_one(place + digit, items);
    }
}
