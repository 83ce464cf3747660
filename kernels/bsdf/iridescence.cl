// Interference in a thin film on the surface, as in glTF's KHR_materials_iridescence: Belcour and Barla 2017, "A
// Practical Extension to Microfacet Theory for the Modeling of Varying Iridescence", with the extension's
// approximations: Schlick's F at both sides of the film, no polarisation, a real index of refraction of the base, and
// two terms of the series. F of the surface is mix(Schlick's F, F of the film, strength).
//
// What the gloss leaves to the lobes below must not be more than the film lets through. It is that of Schlick's F from
// the largest F0, per channel, for which it meets the film's F at some angle: at those of `film_bound` or at this one.
#define FILM_ANGLES 8
#define FILM_LAST_ANGLE 0.4f    // its cosine

// thickness: in nm.
typedef struct { real strength, ior, thickness; } ThinFilm;

// Two Gaussians of X and one each of Y and Z: the color of light whose intensity varies with the wavenumber as
// 1 + cos(path·k + shift), path in nm, apart from the 1.
static inline real3 interference_color(real path, real3 shift) {
    real phase = path * (2e-9f * PI), phase2 = phase * phase;
    real x = 0.84660f * cos(1.6810e6f * phase + shift.x) * exp(-4.3278e9f * phase2)
           + 0.15387f * cos(2.2399e6f * phase + shift.x) * exp(-4.5282e9f * phase2);
    real y = 1.00022f * cos(1.7953e6f * phase + shift.y) * exp(-9.3046e9f * phase2);
    real z = 1.00114f * cos(2.2084e6f * phase + shift.z) * exp(-6.6121e9f * phase2);
    return vector(3.2404542f * x - 1.5371385f * y - 0.4985314f * z, -0.9692660f * x + 1.8760108f * y + 0.0415560f * z,
                  0.0556434f * x - 0.2040259f * y + 1.0572252f * z);
}

static inline real power5(real x) { real x2 = x * x; return x2 * x2 * x; }

// Reflectance at the base below the film at normal incidence, and the shift of the phase there.
static inline void film_base(real f0, real ior, real *reflected, real *shift) {
    real root = sqrt(minimum(maximum(f0, ZERO), (real)(0.9999f))), base = (1.0f + root) / (1.0f - root);
    *reflected = square((base - ior) / (base + ior));
    *shift = base < ior ? (real)(PI) : ZERO;
}

// A channel of the series: the mean in *all, and the amplitude of the first term in *first; the next is *ratio of that.
static inline void film_series(real outer, real base, real *all, real *first, real *ratio) {
    real both = minimum(maximum(outer * base, (real)(1e-5f)), (real)(0.9999f)), through = 1.0f - outer;
    real returned = through * through * base / (1.0f - both);
    *ratio = sqrt(both);
    *all = outer + returned;
    *first = (returned - through) * *ratio;
}

// F of the film over a base of this F0.
static inline real3 film_fresnel(const ThinFilm *film, real3 f0, real cosine) {
    real some = minimum(film->thickness * (1.0f / 0.03f), ONE), ior = 1.0f + (film->ior - 1.0f) * some * some * (3.0f - 2.0f * some);
    real cosine2 = safe_sqrt(1.0f - (1.0f - cosine * cosine) / (ior * ior));
    real r0 = square((ior - 1.0f) / (ior + 1.0f)), outer = r0 + (1.0f - r0) * power5(maximum(1.0f - cosine, ZERO));
    real grazing = power5(1.0f - cosine2);
    real3 base, shift, all, first, ratio;
    film_base(f0.x, ior, &base.x, &shift.x);
    film_base(f0.y, ior, &base.y, &shift.y);
    film_base(f0.z, ior, &base.z, &shift.z);
    base = mad3(sub(splat(ONE), base), grazing, base);
    shift = add(shift, splat((real)(PI)));      // of the reflection at the film's outer side from within
    film_series(outer, base.x, &all.x, &first.x, &ratio.x);
    film_series(outer, base.y, &all.y, &first.y, &ratio.y);
    film_series(outer, base.z, &all.z, &first.z, &ratio.z);
    real path = 2.0f * ior * film->thickness * cosine2;
    all = add(all, mul(first, scale(interference_color(path, shift), (real)(2.0f))));
    all = add(all, mul(mul(first, ratio), scale(interference_color(2.0f * path, scale(shift, (real)(2.0f))), (real)(2.0f))));
    return vector(minimum(maximum(all.x, ZERO), ONE), minimum(maximum(all.y, ZERO), ONE), minimum(maximum(all.z, ZERO), ONE));
}

// F0 in Schlick's form of an F at an angle, at most 1.
static inline real3 f0_of(real3 f, real f90, real cosine) {
    real grazing = power5(maximum(1.0f - cosine, ZERO)), inverse = 1.0f / maximum(1.0f - grazing, (real)(1e-6f));
    real3 f0 = scale(sub(f, splat(f90 * grazing)), inverse);
    return vector(minimum(f0.x, ONE), minimum(f0.y, ONE), minimum(f0.z, ONE));
}

// The largest F0 in Schlick's form of the film's F, over some angles.
static inline real3 film_bound(const ThinFilm *film, real3 f0) {
    real3 bound = splat(ZERO);
    for (int i = 0; i < FILM_ANGLES; ++i) {
        real cosine = (real)(1.0f - i * ((1.0f - FILM_LAST_ANGLE) / (FILM_ANGLES - 1)));
        real3 f = f0_of(film_fresnel(film, f0, cosine), ONE, cosine);
        bound = vector(maximum(bound.x, f.x), maximum(bound.y, f.y), maximum(bound.z, f.z));
    }
    return bound;
}

// F of a surface of which the fraction `strength` has the film; plain: without it.
static inline real3 with_film(const ThinFilm *film, real3 f0, real3 plain, real cosine) {
    ireal covered = film->strength > 0.0f;
    if (!ANY(covered)) return plain;
    return choose(covered, mad3(sub(film_fresnel(film, f0, cosine), plain), film->strength, plain), plain);
}
