// Compaction: structs of lanes stored as structure of arrays, one row per 32-bit word. Lanes chosen by a mask are
// appended to rows contiguously. For 8 lanes.
#include "core/lanes.cl"

#define WORDS(type) ((int)(sizeof(type) / sizeof(ireal)))
#define WORD(value, i) (((ireal *)&(value))[i])
#define EACH_WORD(value) UNROLLED for (int word = 0; word < WORDS(value); ++word)

// Load or store a value as the lanes `first`, first + 1 … of rows.
#define LOAD(value, rows, first) EACH_WORD(value) WORD(value, word) = vload8(0, (rows)[word] + (first));
#define STORE(value, rows, first) EACH_WORD(value) vstore8(WORD(value, word), 0, (rows)[word] + (first));

// Append the lanes in the mask to rows that hold `count`; up to 8 lanes past the end may be overwritten.
#define PACK(value, mask, rows, count) { \
        uint packed = mask_bits(mask), order = lane_order(packed); \
        EACH_WORD(value) store_in_order(WORD(value, word), order, (rows)[word] + (count)); \
        (count) += (int)popcount(packed); \
    }

// Zero the lanes after the last of `count`, with which inactive lanes compute.
#define FILL_UP(type, rows, count) for (int word = 0; word < WORDS(type); ++word) vstore8((ireal)(0), 0, (rows)[word] + (count));

// The mask of lanes below `count`, from index `first` on.
static inline ireal lanes_of(int first, int count) { return first + AS_INT(LANE_INDEX) < count; }
