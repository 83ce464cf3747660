// The film: per pixel the sum of its samples and of their squares, each as a pair of floats.
//
// A plain float sum of n samples stops growing near n = 2^24. Compensated summation keeps the rounding error of every
// addition in a second float (Knuth's two-sum), so the mean is accurate to a few ulps for any n. The two-sum contains
// no products, hence nothing the compiler could contract. Samples that are not finite, or so bright that a sum of
// 2^24 of them would overflow, are dropped and counted.
#include "core/loop_limit.cl"
#include "core/vector.cl"

#define BRIGHTEST 1e31f

typedef struct {
    real3 sum, sum_error, square, square_error;
    ureal count, dropped, rays;
#if DIRECT_LIGHT
    real3 direct, direct_error;   // light of the same samples from paths of at most two segments
#endif
#if CLAMP
    real clamped;                 // energy that clamping removed from them, mean of the channels
#endif
#if ALPHA
    real alpha, alpha_error;      // coverage of the same samples
#endif
#if CATCHER
    real3 caught, caught_error, bare, bare_error;   // light of those of catchers, with and without the objects
    real catcher, catcher_error;                    // the number of those
#endif
#if EMITTER_GROUPS
    real3 groups[GROUPS], groups_error[GROUPS];     // light of the same samples, but of those of catchers, by light group
#endif
} Accumulator;

static inline void two_sum(real *sum, real *error, real x) {
    real s = *sum + x;
    real b = s - *sum;
    real e = *error + ((*sum - (s - b)) + (x - b));
    *sum = s + e;
    *error = e - (*sum - s);
}

// Add a sample to each lane's pixel; return the lanes whose samples were kept.
static inline ireal accumulate(Accumulator *a, real3 sample, ireal counted) {
    real3 size = absolute3(sample);
    ireal finite = (size.x <= BRIGHTEST) & (size.y <= BRIGHTEST) & (size.z <= BRIGHTEST);
    ireal kept = counted & finite;
    real3 L = choose(kept, sample, splat(ZERO));
    a->count += kept ? (ureal)(1) : (ureal)(0);
    a->dropped += (counted & !finite) ? (ureal)(1) : (ureal)(0);
    two_sum(&a->sum.x, &a->sum_error.x, L.x);
    two_sum(&a->sum.y, &a->sum_error.y, L.y);
    two_sum(&a->sum.z, &a->sum_error.z, L.z);
    // Squares are clamped so that their sum does not overflow; their mean is then less than the square of the mean.
    two_sum(&a->square.x, &a->square_error.x, minimum(L.x * L.x, (real)(BRIGHTEST)));
    two_sum(&a->square.y, &a->square_error.y, minimum(L.y * L.y, (real)(BRIGHTEST)));
    two_sum(&a->square.z, &a->square_error.z, minimum(L.z * L.z, (real)(BRIGHTEST)));
    return kept;
}

#if DIRECT_LIGHT
static inline void accumulate_direct(Accumulator *a, real3 sample, ireal kept) {
    real3 L = choose(kept, sample, splat(ZERO));
    two_sum(&a->direct.x, &a->direct_error.x, L.x);
    two_sum(&a->direct.y, &a->direct_error.y, L.y);
    two_sum(&a->direct.z, &a->direct_error.z, L.z);
}
#endif

#if ALPHA
static inline void accumulate_alpha(Accumulator *a, real alpha, ireal kept) {
    two_sum(&a->alpha, &a->alpha_error, kept ? alpha : ZERO);
}
#endif

#if CATCHER
static inline void accumulate_caught(Accumulator *a, real3 sample, ireal caught) {
    real3 L = choose(caught, sample, splat(ZERO));
    two_sum(&a->caught.x, &a->caught_error.x, L.x);
    two_sum(&a->caught.y, &a->caught_error.y, L.y);
    two_sum(&a->caught.z, &a->caught_error.z, L.z);
    two_sum(&a->catcher, &a->catcher_error, caught ? ONE : ZERO);
}

// Add the light of a sample without the objects, which is not counted as one.
static inline void accumulate_bare(Accumulator *a, real3 sample, ireal counted) {
    real3 size = absolute3(sample);
    ireal finite = (size.x <= BRIGHTEST) & (size.y <= BRIGHTEST) & (size.z <= BRIGHTEST);
    real3 L = choose(counted & finite, sample, splat(ZERO));
    two_sum(&a->bare.x, &a->bare_error.x, L.x);
    two_sum(&a->bare.y, &a->bare_error.y, L.y);
    two_sum(&a->bare.z, &a->bare_error.z, L.z);
}
#endif

#if EMITTER_GROUPS
static inline void accumulate_group(Accumulator *a, int group, real3 sample, ireal kept) {
    real3 L = choose(kept, sample, splat(ZERO));
    two_sum(&a->groups[group].x, &a->groups_error[group].x, L.x);
    two_sum(&a->groups[group].y, &a->groups_error[group].y, L.y);
    two_sum(&a->groups[group].z, &a->groups_error[group].z, L.z);
}
#endif

static inline Accumulator load_pixels(global const Pixel *pixels, ireal pixel) {
    WHOLE(Pixel, film, pixels);
    Accumulator loaded = {GATHER3(film, pixel, .sum), GATHER3(film, pixel, .sum_error), GATHER3(film, pixel, .square),
                          GATHER3(film, pixel, .square_error), GATHER(ureal, film, pixel, .count),
                          GATHER(ureal, film, pixel, .dropped), GATHER(ureal, film, pixel, .rays),
#if DIRECT_LIGHT
                          GATHER3(film, pixel, .direct), GATHER3(film, pixel, .direct_error),
#endif
#if CLAMP
                          GATHER(real, film, pixel, .clamped),
#endif
#if ALPHA
                          GATHER(real, film, pixel, .alpha), GATHER(real, film, pixel, .alpha_error),
#endif
#if CATCHER
                          GATHER3(film, pixel, .caught), GATHER3(film, pixel, .caught_error),
                          GATHER3(film, pixel, .bare), GATHER3(film, pixel, .bare_error),
                          GATHER(real, film, pixel, .catcher), GATHER(real, film, pixel, .catcher_error),
#endif
    };
#if EMITTER_GROUPS
    for (int g = 0; g < GROUPS; ++g) {
        loaded.groups[g] = GATHER3(film, pixel, .groups[g][0]);
        loaded.groups_error[g] = GATHER3(film, pixel, .groups[g][1]);
    }
#endif
    return loaded;
}

static inline void store_rows(global float *row, const real3 *value, int lane) {
    row[0] = LANE(value->x, lane);
    row[1] = LANE(value->y, lane);
    row[2] = LANE(value->z, lane);
}

// Store nothing if the driver ended loops early: the host then finds samples missing.
static inline void store_pixels(global Pixel *film, ureal index, ireal stored, const Accumulator *a) {
    if (loops_ended(LANE_UINT(index, 0))) return;
    for (int lane = 0; lane < LANES; ++lane) {
        if (!LANE_INT(stored, lane)) continue;
        global Pixel *pixel = film + LANE_UINT(index, lane);
        store_rows(pixel->sum, &a->sum, lane);
        store_rows(pixel->sum_error, &a->sum_error, lane);
        store_rows(pixel->square, &a->square, lane);
        store_rows(pixel->square_error, &a->square_error, lane);
#if DIRECT_LIGHT
        store_rows(pixel->direct, &a->direct, lane);
        store_rows(pixel->direct_error, &a->direct_error, lane);
#endif
        pixel->count = LANE_UINT(a->count, lane);
        pixel->dropped = LANE_UINT(a->dropped, lane);
        pixel->rays = LANE_UINT(a->rays, lane);
#if CLAMP
        pixel->clamped = LANE(a->clamped, lane);
#endif
#if ALPHA
        pixel->alpha = LANE(a->alpha, lane);
        pixel->alpha_error = LANE(a->alpha_error, lane);
#endif
#if CATCHER
        store_rows(pixel->caught, &a->caught, lane);
        store_rows(pixel->caught_error, &a->caught_error, lane);
        store_rows(pixel->bare, &a->bare, lane);
        store_rows(pixel->bare_error, &a->bare_error, lane);
        pixel->catcher = LANE(a->catcher, lane);
        pixel->catcher_error = LANE(a->catcher_error, lane);
#endif
#if EMITTER_GROUPS
        for (int g = 0; g < GROUPS; ++g) {
            store_rows(pixel->groups[g][0], &a->groups[g], lane);
            store_rows(pixel->groups[g][1], &a->groups_error[g], lane);
        }
#endif
    }
}
