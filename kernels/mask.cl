// Eight lanes' mask as bits: bit i is set where lane i is true (−1).
//
// One instruction where the compiler offers it, else a multiplication that gathers one bit of each byte.

#if defined(__AVX__) && !PORTABLE_MASK
static inline uint mask_bits(int8 mask) { return (uint)__builtin_ia32_movmskps256(as_float8(mask)); }
#else
static inline uint mask_bits(int8 mask) {
    ulong bytes = as_ulong(convert_char8(mask));
    return (uint)(((bytes & 0x8040201008040201UL) * 0x0101010101010101UL) >> 56);
}
#endif

static inline int first_bit(uint bits) { return 31 - (int)clz(bits & -bits); }
