// Bilinear interpolation of images: the four texels around a point and their weights, and what lies outside the image.
#include "core/vector.cl"

#define REPEAT 0
#define MIRROR 1

// Four texels, numbered row by row, and their weights.
typedef struct {
    ireal texel[4];
    real weight[4];
} Bilinear;

#define EACH_TEXEL(i) UNROLLED for (int i = 0; i < 4; ++i)

static inline real on_picture(real u, ireal wrap) {
    real turns = floor(u), pair = u - 2.0f * floor(0.5f * u);
    real mirrored = pair > 1.0f ? 2.0f - pair : pair;
    real clamped = u > 0.0f ? (u < 1.0f ? u : ONE) : ZERO;
    return wrap == REPEAT ? u - turns : wrap == MIRROR ? mirrored : clamped;
}

// Wrap or clamp a column or row by at most one image size; the result is always inside, whatever the coordinates were.
static inline ireal inside(ireal x, ireal size, ireal repeats) {
    ireal around = x < 0 ? x + size : (x >= size ? x - size : x);
    x = repeats ? around : x;
    return x < 0 ? (ireal)(0) : (x >= size ? size - 1 : x);
}

// (u, v): from the upper left corner (0, 0) to the lower right one (1, 1); nearest: only the nearest texel counts.
static inline Bilinear bilinear(real u, real v, ireal width, ireal height, ireal wrap_u, ireal wrap_v, ireal nearest) {
    real x = on_picture(u, wrap_u) * TO_REAL(width) - 0.5f;
    real y = on_picture(v, wrap_v) * TO_REAL(height) - 0.5f;
    real left = floor(x), top = floor(y);
    real right_share = x - left, lower_share = y - top;
    right_share = nearest ? (right_share < 0.5f ? ZERO : ONE) : right_share;
    lower_share = nearest ? (lower_share < 0.5f ? ZERO : ONE) : lower_share;
    ireal first_column = inside(TO_INT(left), width, wrap_u == REPEAT);
    ireal first_row = inside(TO_INT(top), height, wrap_v == REPEAT);
    ireal last_column = inside(TO_INT(left) + 1, width, wrap_u == REPEAT);
    ireal last_row = inside(TO_INT(top) + 1, height, wrap_v == REPEAT);
    Bilinear found;
    EACH_TEXEL(i) {
        found.texel[i] = (i >> 1 ? last_row : first_row) * width + (i & 1 ? last_column : first_column);
        found.weight[i] = (i & 1 ? right_share : 1.0f - right_share) * (i >> 1 ? lower_share : 1.0f - lower_share);
    }
    return found;
}
