// Ray–sphere intersection: both roots, accurate from outside and inside (Nadolny 1.8).
//
// With f from the centre to the origin: a·t² + 2b·t + c = 0, a = d·d, b = f·d, c = f·f − r², and a quarter of the
// discriminant is a·r² − |f×d|² (Haines et al. 2019, "Precision Improvements for Ray/Sphere Intersection", Ray Tracing
// Gems, ch. 7, from the closest approach). Terms with cancellation are computed in double-word arithmetic: c near the
// surface of a large sphere, and the cross product far from a small one. The sign of c says on which side the origin
// is, so a ray that leaves a sphere never hits it; the smaller root comes from the product of the roots.
//
// may_meet rejects most missed spheres early, in single precision: each of its three terms has an error of at most 8 u
// of |f|²·a, and its margin is 64 u of that.
#include "geometry/twice.cl"
#include "core/vector.cl"

#define SPHERE_OF(type, mask, Twice, name) \
    TWICE_OF(type, Twice, name) \
    static inline Twice name##_dot(const Twice a[3], const Twice b[3]) { \
        return name##_sum(name##_sum(name##_product(a[0], b[0]), name##_product(a[1], b[1])), name##_product(a[2], b[2])); \
    } \
    static inline mask name##_may_hit(const type f[3], const type d[3], float radius) { \
        type x = f[1] * d[2] - f[2] * d[1], y = f[2] * d[0] - f[0] * d[2], z = f[0] * d[1] - f[1] * d[0]; \
        type a = d[0] * d[0] + d[1] * d[1] + d[2] * d[2], b = f[0] * d[0] + f[1] * d[1] + f[2] * d[2]; \
        type ff = f[0] * f[0] + f[1] * f[1] + f[2] * f[2], rounding = 64.0f * UNIT_ROUNDOFF * ff, r2 = radius * radius; \
        mask beside = x * x + y * y + z * z > a * (r2 * (1.0f + 64.0f * UNIT_ROUNDOFF) + rounding); \
        mask behind = (ff > r2 + rounding) & (b > 0.0f) & (b * b > a * rounding); \
        return !(beside | behind); \
    } \
    static inline void name##_roots(const type origin[3], const type direction[3], global const float *center, \
                                    float radius, type *near, type *far) { \
        Twice f[3], d[3], r = {radius, 0.0f}; \
        for (int k = 0; k < 3; ++k) { \
            f[k] = name##_difference(origin[k], center[k]); \
            d[k] = (Twice){direction[k], 0.0f}; \
        } \
        Twice n[3] = {name##_minor(f[1], f[2], d[1], d[2]), name##_minor(f[2], f[0], d[2], d[0]), \
                      name##_minor(f[0], f[1], d[0], d[1])}; \
        Twice a = name##_dot(d, d), r2 = name##_product(r, r); \
        type discriminant = name##_value(name##_sum(name##_product(a, r2), name##_negative(name##_dot(n, n)))); \
        type b = name##_value(name##_dot(f, d)), c = name##_value(name##_sum(name##_dot(f, f), name##_negative(r2))); \
        type q = -b - copysign(sqrt(discriminant), b);   /* NaN on a miss */ \
        type t0 = c / q, t1 = q / name##_value(a); \
        *near = t0 < t1 ? t0 : t1; \
        *far = t0 < t1 ? t1 : t0; \
    }
