// Shared parts of the triangle tests that use the ray untransformed and compute t, u, v.
#include "geometry/wide.cl"
#include "core/vector.cl"

typedef Ray TriangleRay;

typedef int TriangleRays;
static inline TriangleRays triangle_rays(real3 origin, real3 direction) { return 0; }
static inline TriangleRay triangle_ray(const TriangleRays *rays, const Ray *ray, int lane) { return *ray; }

// u and v are NaN or infinite if the triangle is degenerate or parallel to the ray: every comparison fails then.
static inline WideHit inside_triangle(wide t, wide u, wide v, float t_max) {
    return (WideHit){t, u, v, (u >= 0.0f) & (v >= 0.0f) & (u + v <= 1.0f) & (t > 0.0f) & (t <= t_max)};
}
