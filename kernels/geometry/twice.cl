// Double-word arithmetic, hi + lo, where float rounding would decide wrongly (Dekker 1971, "A Floating-Point Technique
// for Extending the Available Precision"; Joldes et al. 2017, "Tight and Rigorous Error Bounds for Basic Building
// Blocks of Double-Word Arithmetic"). Sums and products are accurate to a few units of 2^-46.
//
// Macros over the type: float for single values, wide for several at once.

#define TWICE_OF(type, Twice, name) \
    typedef struct { type hi, lo; } Twice; \
    static inline Twice name##_difference(type a, type b) { \
        type s = a - b, z = s - a; \
        return (Twice){s, (a - (s - z)) - (b + z)}; \
    } \
    static inline Twice name##_sum(Twice a, Twice b) { \
        type s = a.hi + b.hi, z = s - a.hi; \
        type e = ((a.hi - (s - z)) + (b.hi - z)) + (a.lo + b.lo), hi = s + e; \
        return (Twice){hi, e - (hi - s)}; /* renormalise, for cancellation of the high words */ \
    } \
    static inline Twice name##_product(Twice a, Twice b) { \
        type p = a.hi * b.hi; \
        return (Twice){p, fma(a.hi, b.hi, -p) + fma(a.hi, b.lo, a.lo * b.hi)}; \
    } \
    static inline Twice name##_negative(Twice a) { return (Twice){-a.hi, -a.lo}; } \
    static inline Twice name##_minor(Twice a, Twice b, Twice c, Twice d) { /* a·d − b·c */ \
        return name##_sum(name##_product(a, d), name##_negative(name##_product(b, c))); \
    } \
    static inline type name##_value(Twice a) { return a.hi + a.lo; }
