// Triangles are stored in packs of PACK_SIZE: 1 in BVHs of single triangles, 8 if a leaf is a pack, 16 without a BVH.
// They are tested WIDTH at a time: all of a pack, or sixteen in halves if no register holds them. `wide` holds one
// float of each; LOAD_WIDE reads a row of a record, whatever the width.
#include "core/mask.cl"

#ifndef WIDTH
#if PACK_SIZE == 16 && !defined(__AVX512F__)
#define WIDTH 8
#else
#define WIDTH PACK_SIZE
#endif
#endif

#if WIDTH == 1
typedef float wide;
typedef int wide_mask;
#define LOAD_WIDE(row) (row)
#define WIDE_ANY(mask) (mask)
#define WIDE_ABS(x) fabs(x)
#elif WIDTH == 8
typedef float8 wide;
typedef int8 wide_mask;
#define LOAD_WIDE(row) vload8(0, row)
#define WIDE_BITS(x) as_int8(x)
#define WIDE_FLOATS(x) as_float8(x)
static inline uint wide_bits(wide_mask mask) { return mask_bits(mask); }
#else
typedef float16 wide;
typedef int16 wide_mask;
#define LOAD_WIDE(row) vload16(0, row)
#define WIDE_BITS(x) as_int16(x)
#define WIDE_FLOATS(x) as_float16(x)
static inline uint wide_bits(wide_mask mask) { return mask_bits16(mask); }
#endif
#if WIDTH > 1
#define WIDE_ANY(mask) (wide_bits(mask) != 0)
#define WIDE_ABS(x) WIDE_FLOATS(WIDE_BITS(x) & 0x7fffffff)
#endif

typedef struct {
    float origin[3], direction[3], t_max;      // t is in multiples of the length of `direction`
#if NEXT_HIT
    float after_t;                             // only hits after this one count, by t and then by primitive
    int after_primitive;
#if INSTANCES
    int after_instance;
#endif
#endif
#if INSTANCES
    int instance;                              // the instance in whose frame the ray is, or IN_WORLD
#endif
#if MOTION
    float time;                                // see integrator/shutter.cl
#endif
} Ray;
typedef struct {
    float t, u, v;
    int primitive;                             // < 0: miss
#if INSTANCES
    int instance;
#endif
} Hit;
typedef struct { wide t, u, v; wide_mask hit; } WideHit;

static inline wide wide_max3(wide a, wide b, wide c) {
    wide ab = a > b ? a : b;
    return ab > c ? ab : c;
}

static inline wide wide_min3(wide a, wide b, wide c) {
    wide ab = a < b ? a : b;
    return ab < c ? ab : c;
}
