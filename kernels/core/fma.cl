// Software a·b + c, rounded once, for devices without an fma instruction, where the driver's own function takes 40 ms
// to compile per use and ten times as long to run (measured with Mesa 22.3). The result is bit-exact unless the product
// is below 2^-100, since its error may then not be representable. (Dekker 1971; Boldo and Melquiond 2008, "Emulation of
// a FMA and Correctly Rounded Sums: Proved Algorithms Using Rounding to Odd".)
#define FUSED(type, uints, as_uints, as_type) \
    /* The float nearest to a + b, and its error. */ \
    static inline type __attribute__((overloadable)) sum_of(type a, type b, type *lacks) { \
        type s = a + b, z = s - a; \
        *lacks = (a - (s - z)) + (b - z); \
        return s; \
    } \
    static inline type __attribute__((overloadable)) fused(type a, type b, type c) { \
        /* Split into halves of twelve bits, whose products are exact, and so is the product's error. */ \
        type a_high = as_type(as_uints(a) & 0xfffff000u), a_low = a - a_high; \
        type b_high = as_type(as_uints(b) & 0xfffff000u), b_low = b - b_high; \
        type product = a * b, lower, low, lost; \
        type lacks = a_low * b_low - (((product - a_high * b_high) - a_low * b_high) - a_high * b_low); \
        type high = sum_of(product, sum_of(c, lacks, &lower), &low), rest = sum_of(lower, low, &lost); \
        /* Round to odd, which leaves no tie for the last sum. */ \
        uints bits = as_uints(rest), unlike = (bits ^ as_uints(lost)) >> 31; \
        bits += ((lost != 0.0f) & ((bits & 1u) == 0u)) ? 1u - 2u * unlike : (uints)(0); \
        type sum = high + as_type(bits); \
        return sum - sum == 0.0f ? sum : product + c; \
    }
FUSED(float, uint, as_uint, as_float)
FUSED(float3, uint3, as_uint3, as_float3)
FUSED(float8, uint8, as_uint8, as_float8)
FUSED(float16, uint16, as_uint16, as_float16)
#define fma(a, b, c) fused(a, b, c)
