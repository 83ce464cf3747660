// Ray against a sphere: nearest root beyond t_min, right from outside and inside (Nadolny 1.8).
//
// With f from the centre to the origin: a·t² + 2b·t + c = 0, a = d·d, b = f·d, c = f·f − r², and a quarter of the
// discriminant is a·r² − |f×d|² (Haines et al. 2019, "Precision Improvements for Ray/Sphere Intersection", Ray Tracing
// Gems, ch. 7, from the closest approach). What cancels there is computed in twice as many digits: c near the surface of
// a large sphere, and the cross product far from a small one. The sign of c says on which side the origin is, so a ray
// that leaves never meets its own sphere; the smaller root comes from the product of the roots.
#include "geometry/wide.cl"
#include "geometry/twice.cl"

TWICE_OF(float, Twice, twice)

static inline Twice twice_dot(Twice a[3], Twice b[3]) {
    return twice_sum(twice_sum(twice_product(a[0], b[0]), twice_product(a[1], b[1])), twice_product(a[2], b[2]));
}

static inline bool intersect_sphere(const Ray *ray, global const LeafSphere *sphere, float t_min, float t_max,
                                    float *t) {
    Twice f[3], d[3], r = {sphere->radius, 0.0f};
    for (int k = 0; k < 3; ++k) {
        f[k] = twice_difference(ray->origin[k], sphere->center[k]);
        d[k] = (Twice){ray->direction[k], 0.0f};
    }
    Twice n[3] = {twice_minor(f[1], f[2], d[1], d[2]), twice_minor(f[2], f[0], d[2], d[0]), twice_minor(f[0], f[1], d[0], d[1])};
    Twice a = twice_dot(d, d), r2 = twice_product(r, r);
    float discriminant = twice_value(twice_sum(twice_product(a, r2), twice_negative(twice_dot(n, n))));
    if (!(discriminant >= 0.0f)) return false;
    float b = twice_value(twice_dot(f, d)), c = twice_value(twice_sum(twice_dot(f, f), twice_negative(r2)));
    float q = -b - copysign(sqrt(discriminant), b);
    float t0 = c / q, t1 = q / twice_value(a);
    float near = t0 < t1 ? t0 : t1, far = t0 < t1 ? t1 : t0;
    *t = near > t_min ? near : far;
    return *t > t_min && *t <= t_max;
}
