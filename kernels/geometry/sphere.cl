// Ray against a sphere: nearest root beyond 0, right from outside and inside (Nadolny 1.8).
//
// The discriminant is taken from the closest approach to the centre, and the smaller root from the product of the
// roots, so that neither a small far sphere nor a grazing ray loses its digits (Haines et al. 2019, "Precision
// Improvements for Ray/Sphere Intersection", Ray Tracing Gems, ch. 7).
#include "geometry/wide.cl"

static inline bool intersect_sphere(const Ray *ray, global const LeafSphere *sphere, float t_max, float *t) {
    const float *d = ray->direction;
    float fx = ray->origin[0] - sphere->center[0];
    float fy = ray->origin[1] - sphere->center[1];
    float fz = ray->origin[2] - sphere->center[2];
    float r = sphere->radius;
    float a = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    float b = -(fx * d[0] + fy * d[1] + fz * d[2]);
    float s = b / a;
    float lx = fx + s * d[0], ly = fy + s * d[1], lz = fz + s * d[2];
    float discriminant = r * r - (lx * lx + ly * ly + lz * lz);
    if (!(discriminant >= 0.0f)) return false;
    float f = sqrt(fx * fx + fy * fy + fz * fz);
    float c = (f - r) * (f + r);
    float q = b + copysign(sqrt(a * discriminant), b);
    float t0 = c / q, t1 = q / a;
    float near = t0 < t1 ? t0 : t1, far = t0 < t1 ? t1 : t0;
    *t = near > 0.0f ? near : far;
    return *t > 0.0f && *t <= t_max;
}
