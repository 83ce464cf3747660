// For triangle tests that take the ray as it comes and end with t, u, v.
#include "geometry/wide.cl"
#include "vector.cl"

typedef Ray TriangleRay;

typedef int TriangleRays;
static inline TriangleRays triangle_rays(real3 origin, real3 direction) { return 0; }
static inline TriangleRay triangle_ray(const TriangleRays *rays, const Ray *ray, int lane) { return *ray; }

// u and v are NaN or infinite where the triangle has no area or the ray runs along it: no comparison lets that through.
static inline WideHit inside_triangle(wide t, wide u, wide v, float t_max) {
    return (WideHit){t, u, v, (u >= 0.0f) & (v >= 0.0f) & (u + v <= 1.0f) & (t > 0.0f) & (t <= t_max)};
}
