// Structs of lanes in rows: taken apart into words of a lane each, a row a word. Lanes can be appended to rows one by one, so
// that those chosen by a mask close up. For 8 lanes.
#include "lanes.cl"

#define WORDS(type) ((int)(sizeof(type) / sizeof(ireal)))
#define WORD(value, i) (((ireal *)&(value))[i])
#define EACH_WORD(value) _Pragma("unroll") for (int word = 0; word < WORDS(value); ++word)

// Between a value and the lanes `first`, first + 1 … of rows.
#define LOAD(value, rows, first) EACH_WORD(value) WORD(value, word) = vload8(0, (rows)[word] + (first));
#define STORE(value, rows, first) EACH_WORD(value) vstore8(WORD(value, word), 0, (rows)[word] + (first));

// Appends the lanes in the mask to rows that hold `count`; up to 8 lanes further anything may be overwritten.
#define PACK(value, mask, rows, count) { \
        uint packed = mask_bits(mask), order = lane_order(packed); \
        EACH_WORD(value) store_in_order(WORD(value, word), order, (rows)[word] + (count)); \
        (count) += (int)popcount(packed); \
    }

// Fills up the last lanes of rows that hold `count`: what idle lanes compute with is 0.
#define FILL_UP(type, rows, count) for (int word = 0; word < WORDS(type); ++word) vstore8((ireal)(0), 0, (rows)[word] + (count));

// The lanes that hold one of `count`, from `first` on.
static inline ireal lanes_of(int first, int count) { return first + AS_INT(LANE_INDEX) < count; }
