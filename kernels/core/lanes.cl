// Lane types: the shading code is written once in terms of them and compiled for a SIMD width of 1, 8 or 16 paths per
// work-item.
//
// real, ireal, ureal   a float, int, uint per path           real3   a vector of three reals
// A mask is an ireal, the result of a comparison. Scalars are 0/1 and vectors 0/-1, so masks are only used in `m ? a :
// b`, `a & b`, `a | b`, `!m` and ANY(m), which mean the same for both.
// GATHER(type, array, index, .member) reads one record of an array per lane; inactive lanes need a valid index, too.

#include "core/mask.cl"
#include "core/arrays.cl"

#define PASTE_(a, b) a##b
#define PASTE(a, b) PASTE_(a, b)

#if LANES == 1
typedef float real;
typedef int ireal;
typedef uint ureal;
#define ANY(mask) (mask)
#define GATHER(type, array, index, member) ((type)(RECORD(array, index)[0] member))
#define TO_REAL(x) ((float)(x))
#define TO_INT(x) ((int)(x))
#define TO_UINT(x) ((uint)(x))
#define AS_INT(x) as_int(x)
#define AS_REAL(x) as_float(x)
#define LANE_INDEX ((uint)0)
#else
typedef PASTE(float, LANES) real;
typedef PASTE(int, LANES) ireal;
typedef PASTE(uint, LANES) ureal;
#define TO_REAL(x) PASTE(convert_float, LANES)(x)
#define TO_INT(x) PASTE(convert_int, LANES)(x)
#define TO_UINT(x) PASTE(convert_uint, LANES)(x)
#define AS_INT(x) PASTE(as_int, LANES)(x)
#define AS_REAL(x) PASTE(as_float, LANES)(x)
#define GATHER8_(a, i, m) RECORD(a, (i).s0)[0] m, RECORD(a, (i).s1)[0] m, RECORD(a, (i).s2)[0] m, RECORD(a, (i).s3)[0] m, \
                          RECORD(a, (i).s4)[0] m, RECORD(a, (i).s5)[0] m, RECORD(a, (i).s6)[0] m, RECORD(a, (i).s7)[0] m
#if LANES == 8
#define ANY(mask) (mask_bits(mask) != 0)
#define GATHER(type, array, index, member) ((type)(GATHER8_(array, index, member)))
#define LANE_INDEX ((ureal)(0, 1, 2, 3, 4, 5, 6, 7))
#elif LANES == 16
#define ANY(mask) any(mask)
#define GATHER(type, array, index, member) ((type)(GATHER8_(array, (index).lo, member), GATHER8_(array, (index).hi, member)))
#define LANE_INDEX ((ureal)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15))
#endif
#endif

typedef struct { real x, y; } real2;
typedef struct { ureal x, y; } ureal2;
typedef struct { ureal x, y, z, w; } ureal4;
typedef struct { real x, y, z; } real3;

#define GATHER3(array, index, member) ((real3){GATHER(real, array, index, member[0]), \
                                               GATHER(real, array, index, member[1]), \
                                               GATHER(real, array, index, member[2])})

// Access to single lanes, for code that handles single rays: unions to write, LANE… to read.
typedef union { real all; float lane[LANES]; } RealLanes;
typedef union { ireal all; int lane[LANES]; } IntLanes;
#define LANE(value, lane) (((const float *)&(value))[lane])
#define LANE_INT(value, lane) (((const int *)&(value))[lane])
#define LANE_UINT(value, lane) (((const uint *)&(value))[lane])

// For loops over the elements of a small private array: unrolled, the elements are kept in registers.
#define UNROLLED _Pragma("unroll")

#define ZERO ((real)(0.0f))
#define ONE ((real)(1.0f))
#define ALL_LANES ((real)(0.0f) == (real)(0.0f))
#define NO_LANES ((real)(0.0f) != (real)(0.0f))
