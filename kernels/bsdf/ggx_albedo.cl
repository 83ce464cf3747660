// Directional albedos of GGX: the fraction of light from an angle that a single bounce reflects, with Schlick's F,
//   E(c) = f0·by_f0(c) + f90·by_f90(c)
// and the fraction a single bounce loses with F = 1, which hits further microfacets: lost = 1 − by_f0 − by_f90.
// Computed by fits over all angles and roughnesses for each form of masking–shadowing:
//   lost   = t² or t, t = (1 − q)·P(x, y), q = c/(c + width), x = 2·√(q·(1 + width)) − 1, y = 2·roughness − 1
//   by_f90 = (1 − lost)·(1 − g)^5,         g = c + alpha·P(x, y), x with the width 2·alpha, y = 2·√roughness − 1
// q maps the features at cosines of about `width` to the same position for every alpha, and the root resolves the slope
// of c·log c at c = 0; width is 2·alpha for Smith's forms. Beyond its peak Smith's loss falls with 1/c², as (1 − q)²
// does, Schlick's with 1/c. The hemispherical means, weighted by 2·c, are polynomials in y = 2·√roughness − 1, that of
// `lost` times `scale`. The fits are accurate to 1e-3 (tests/rendering/test_ggx_albedo.py computes the integrals in
// float64).
#define SCHLICK_FORMS (ALBEDO_SCHLICK || ALBEDO_SCHLICK_IBL)
#define LOSS_X 8
#define LOSS_Y 8
#define FRESNEL_X 8
#define FRESNEL_Y 6
#define MEAN_LOSS_Y 12
#define MEAN_FRESNEL_Y 9

typedef struct { real by_f0, by_f90, lost; } Bounce;

// Fits for one roughness: coefficients of x, widths, and the hemispherical means.
typedef struct {
    real alpha, loss[LOSS_X], fresnel[FRESNEL_X];
    Bounce mean;
#if SCHLICK_FORMS
    real loss_width;
    ireal squared;
#endif
} GgxAlbedo;

// Evaluate the tables of one form of masking at this alpha.
static inline GgxAlbedo ggx_albedo_of(real alpha, real width, ireal squared, real scale, constant float (*loss)[LOSS_Y],
                                      constant float (*fresnel)[FRESNEL_Y], constant float *mean_loss,
                                      constant float *mean_fresnel) {
    GgxAlbedo a;
    a.alpha = alpha;
#if SCHLICK_FORMS
    a.loss_width = width;
    a.squared = squared;
#endif
    real roughness = sqrt(alpha), y = 2.0f * roughness - 1.0f, root_y = 2.0f * sqrt(roughness) - 1.0f;
    UNROLLED for (int k = 0; k < LOSS_X; ++k) {
        real sum = ZERO;
        UNROLLED for (int j = LOSS_Y - 1; j >= 0; --j) sum = sum * y + loss[k][j];
        a.loss[k] = sum;
    }
    UNROLLED for (int k = 0; k < FRESNEL_X; ++k) {
        real sum = ZERO;
        UNROLLED for (int j = FRESNEL_Y - 1; j >= 0; --j) sum = sum * root_y + fresnel[k][j];
        a.fresnel[k] = sum;
    }
    real lost = ZERO, by_f90 = ZERO;
    UNROLLED for (int j = MEAN_LOSS_Y - 1; j >= 0; --j) lost = lost * root_y + mean_loss[j];
    UNROLLED for (int j = MEAN_FRESNEL_Y - 1; j >= 0; --j) by_f90 = by_f90 * root_y + mean_fresnel[j];
    a.mean.lost = scale * lost;
    a.mean.by_f90 = by_f90;
    a.mean.by_f0 = 1.0f - a.mean.lost - by_f90;
    return a;
}

static inline Bounce ggx_bounce(const GgxAlbedo *a, real cos_theta) {
    real width = 2.0f * a->alpha, sum = ZERO, g = ZERO;
    real q = cos_theta / (cos_theta + width), x = 2.0f * sqrt(q * (1.0f + width)) - 1.0f;
    UNROLLED for (int k = FRESNEL_X - 1; k >= 0; --k) g = g * x + a->fresnel[k];
#if SCHLICK_FORMS
    q = cos_theta / (cos_theta + a->loss_width);
    x = 2.0f * sqrt(q * (1.0f + a->loss_width)) - 1.0f;
#endif
    UNROLLED for (int k = LOSS_X - 1; k >= 0; --k) sum = sum * x + a->loss[k];
    Bounce bounce;
    real far = 1.0f - minimum(maximum(cos_theta + a->alpha * g, ZERO), ONE);
    bounce.lost = maximum((1.0f - q) * sum, ZERO);
#if SCHLICK_FORMS
    bounce.lost = a->squared ? square(bounce.lost) : bounce.lost;
#else
    bounce.lost = square(bounce.lost);
#endif
    bounce.by_f90 = (1.0f - bounce.lost) * square(square(far)) * far;
    bounce.by_f0 = 1.0f - bounce.lost - bounce.by_f90;
    return bounce;
}

#if ALBEDO_HEIGHT_CORRELATED + ALBEDO_SEPARABLE + ALBEDO_SCHLICK + ALBEDO_SCHLICK_IBL > 1
static inline GgxAlbedo choose_ggx_albedo(ireal mask, GgxAlbedo a, GgxAlbedo b) {
    GgxAlbedo chosen = a;
    for (int k = 0; k < LOSS_X; ++k) chosen.loss[k] = mask ? a.loss[k] : b.loss[k];
    for (int k = 0; k < FRESNEL_X; ++k) chosen.fresnel[k] = mask ? a.fresnel[k] : b.fresnel[k];
    chosen.mean.lost = mask ? a.mean.lost : b.mean.lost;
    chosen.mean.by_f90 = mask ? a.mean.by_f90 : b.mean.by_f90;
    chosen.mean.by_f0 = mask ? a.mean.by_f0 : b.mean.by_f0;
#if SCHLICK_FORMS
    chosen.loss_width = mask ? a.loss_width : b.loss_width;
    chosen.squared = mask ? a.squared : b.squared;
#endif
    return chosen;
}
#endif

#include ALBEDO_HEIGHT_CORRELATED_FILE
#include ALBEDO_SEPARABLE_FILE
#include ALBEDO_SCHLICK_FILE
#include ALBEDO_SCHLICK_IBL_FILE

#if ALBEDO_HEIGHT_CORRELATED + ALBEDO_SEPARABLE + ALBEDO_SCHLICK + ALBEDO_SCHLICK_IBL == 1
#define TAKE_FORM(number, name) bounces = name##_albedo(alpha)
#else
#define TAKE_FORM(number, name) bounces = choose_ggx_albedo(smith == number, name##_albedo(alpha), bounces)
#endif

// Select the tables by the forms of masking that the scene's materials use.
static inline GgxAlbedo bounces_of(real alpha, ireal smith) {
    GgxAlbedo bounces = {ZERO};
#if ALBEDO_HEIGHT_CORRELATED
    TAKE_FORM(0, height_correlated);
#endif
#if ALBEDO_SEPARABLE
    TAKE_FORM(1, separable);
#endif
#if ALBEDO_SCHLICK
    TAKE_FORM(2, schlick);
#endif
#if ALBEDO_SCHLICK_IBL
    TAKE_FORM(3, schlick_ibl);
#endif
    return bounces;
}

// Directional albedo of a single bounce with Schlick's F between f0 and f90.
static inline real3 bounce_albedo(real3 f0, real f90, Bounce bounce) {
    return mad3(f0, bounce.by_f0, splat(f90 * bounce.by_f90));
}
