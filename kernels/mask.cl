// Masks of eight and sixteen lanes as bits: bit i is set where lane i is true (−1). And what only CPUs have: one
// instruction for that, one for putting lanes side by side, and prefetching; elsewhere the same is said in portable words.
//
// __AVX__ and the like are defined where a compiler makes code for such a processor directly.

// Clang warns where another processor would pass a vector to a function in another way. No other code calls these.
#pragma clang diagnostic ignored "-Wpsabi"

#if defined(__AVX__) && !PORTABLE_MASK
static inline uint mask_bits(int8 mask) { return (uint)__builtin_ia32_movmskps256(as_float8(mask)); }
#if defined(__AVX512DQ__)
static inline uint mask_bits16(int16 mask) { return (ushort)__builtin_ia32_cvtd2mask512(mask); }
#else
static inline uint mask_bits16(int16 mask) { return mask_bits(mask.lo) | mask_bits(mask.hi) << 8; }
#endif
#else
static inline uint mask_bits(int8 mask) {
    ulong bytes = as_ulong(convert_char8(mask));
    return (uint)(((bytes & 0x8040201008040201UL) * 0x0101010101010101UL) >> 56);
}
// By bytes: Oclgrind takes the upper half of sixteen lanes for uninitialised.
static inline uint mask_bits16(int16 mask) {
    ulong2 bits = ((as_ulong2(convert_char16(mask)) & 0x8040201008040201UL) * 0x0101010101010101UL) >> 56;
    return (uint)(bits.x | bits.y << 8);
}
#endif

static inline int first_bit(uint bits) { return (int)popcount(~bits & (bits - 1)); }

// Writes the lanes whose bits are set to target[0], [1] …; up to target[7] anything may be overwritten.
#if defined(__AVX512VL__) && !PORTABLE_MASK
static inline void store_lanes(int8 lanes, uint bits, int *target) {
    vstore8(__builtin_ia32_compresssi256_mask(lanes, lanes, (uchar)bits), 0, target);
}
#else
static inline void store_lanes(int8 lanes, uint bits, int *target) {
    int all[8];
    vstore8(lanes, 0, all);
    for (; bits; bits &= bits - 1) *target++ = all[first_bit(bits)];
}
#endif

// The same for many values by one mask: store_in_order(lanes, lane_order(bits), target).
#if defined(__AVX512VL__) && !PORTABLE_MASK
static inline uint lane_order(uint bits) { return bits; }
static inline void store_in_order(int8 lanes, uint order, int *target) { store_lanes(lanes, order, target); }
#else
// The numbers of the lanes whose bits are set, four bits each.
static inline uint lane_order(uint bits) {
    uint order = 0;
    for (uint shift = 0; bits; bits &= bits - 1, shift += 4) order |= (uint)first_bit(bits) << shift;
    return order;
}
#if defined(__AVX2__) && !PORTABLE_MASK
static inline void store_in_order(int8 lanes, uint order, int *target) {
    int8 from = (int8)((int)order) >> (int8)(0, 4, 8, 12, 16, 20, 24, 28);
    vstore8(__builtin_ia32_permvarsi256(lanes, from), 0, target);
}
#else
static inline void store_in_order(int8 lanes, uint order, int *target) {
    int all[8];
    vstore8(lanes, 0, all);
    for (int k = 0; k < 8; ++k) target[k] = all[order >> 4 * k & 7];
}
#endif
#endif

// The lane, of those in the mask, with the least number; all are >= 0. Numbers that differ in their last three bits only
// count as equal. 7 where the mask is empty.
static inline int least_lane(float8 numbers, int8 mask) {
    int8 eight = mask ? (as_int8(numbers) & ~7) | (int8)(0, 1, 2, 3, 4, 5, 6, 7) : (int8)(0x7fffffff);
    int4 four = eight.lo < eight.hi ? eight.lo : eight.hi;
    int2 two = four.lo < four.hi ? four.lo : four.hi;
    return (two.x < two.y ? two.x : two.y) & 7;
}

// Brings the cache lines of `bytes` from `address` on near; where that cannot be said, nothing.
#if defined(__SSE2__) && !PORTABLE_MASK
#define PREFETCH(address, bytes) _Pragma("unroll") for (int line = 0; line < (bytes); line += 64) \
    __builtin_prefetch((global const char *)(address) + line);
#else
#define PREFETCH(address, bytes)
#endif
