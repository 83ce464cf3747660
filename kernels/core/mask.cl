// Masks of eight and sixteen lanes as bits: bit i is set if lane i is true (−1). Also CPU intrinsics, with portable
// fallbacks: one instruction for such a mask, one for compressing lanes, and prefetching.
//
// __AVX__ and the like are defined if the compiler generates code for such a CPU directly.

// Clang warns about the vector calling convention of other CPUs; these functions are only called from this program.
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
// Via bytes: Oclgrind reports the upper half of sixteen lanes as uninitialised.
static inline uint mask_bits16(int16 mask) {
    ulong2 bits = ((as_ulong2(convert_char16(mask)) & 0x8040201008040201UL) * 0x0101010101010101UL) >> 56;
    return (uint)(bits.x | bits.y << 8);
}
#endif

static inline int first_bit(uint bits) { return (int)popcount(~bits & (bits - 1)); }

// Write the lanes whose bits are set to target[0], [1] …; everything up to target[7] may be overwritten.
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

// The same for several values with one mask: store_in_order(lanes, lane_order(bits), target).
#if defined(__AVX512VL__) && !PORTABLE_MASK
static inline uint lane_order(uint bits) { return bits; }
static inline void store_in_order(int8 lanes, uint order, int *target) { store_lanes(lanes, order, target); }
#else
// The indices of the lanes whose bits are set, four bits each.
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

// The lane with the smallest number among those in the mask; all numbers are >= 0. Numbers that differ only in their
// last three bits compare equal. 7 if the mask is empty.
static inline int least_lane(float8 numbers, int8 mask) {
    int8 eight = mask ? (as_int8(numbers) & ~7) | (int8)(0, 1, 2, 3, 4, 5, 6, 7) : (int8)(0x7fffffff);
    int4 four = eight.lo < eight.hi ? eight.lo : eight.hi;
    int2 two = four.lo < four.hi ? four.lo : four.hi;
    return (two.x < two.y ? two.x : two.y) & 7;
}

// Prefetch the cache lines of `bytes` from `address` on, if supported.
#if defined(__SSE2__) && !PORTABLE_MASK
#define PREFETCH(address, bytes) _Pragma("unroll") for (int line = 0; line < (bytes); line += 64) \
    __builtin_prefetch((global const char *)(address) + line);
#else
#define PREFETCH(address, bytes)
#endif
