// Ray–sphere intersection by the textbook quadratic formula (Nadolny 1.8): a·t² + b·t + c = 0, both roots. It suffers
// from cancellation of b² and 4ac, or of −b and the root: small or distant spheres, and huge ones nearby.
#include "core/vector.cl"

#define SPHERE_OF(type, mask, Twice, name) \
    static inline mask name##_may_hit(const type f[3], const type d[3], float radius) { \
        type a = d[0] * d[0] + d[1] * d[1] + d[2] * d[2], b = f[0] * d[0] + f[1] * d[1] + f[2] * d[2]; \
        return b * b >= a * (f[0] * f[0] + f[1] * f[1] + f[2] * f[2] - radius * radius); \
    } \
    static inline void name##_roots(const type origin[3], const type d[3], global const float *center, float radius, \
                                    type *near, type *far) { \
        type fx = origin[0] - center[0], fy = origin[1] - center[1], fz = origin[2] - center[2]; \
        type a = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]; \
        type b = 2.0f * (fx * d[0] + fy * d[1] + fz * d[2]); \
        type c = fx * fx + fy * fy + fz * fz - radius * radius; \
        type root = sqrt(b * b - 4.0f * a * c);   /* NaN on a miss */ \
        *near = (-b - root) / (2.0f * a); \
        *far = (-b + root) / (2.0f * a); \
    }
