// Ray against a sphere by the quadratic formula of textbooks (Nadolny 1.8): a·t² + b·t + c = 0, nearest root beyond t_min.
// It loses digits where b² and 4ac, or −b and the root, nearly cancel: small or far spheres, and huge ones near by.
#include "geometry/wide.cl"

static inline bool intersect_sphere(const Ray *ray, global const LeafSphere *sphere, float t_min, float t_max,
                                    float *t) {
    const float *d = ray->direction;
    float fx = ray->origin[0] - sphere->center[0];
    float fy = ray->origin[1] - sphere->center[1];
    float fz = ray->origin[2] - sphere->center[2];
    float a = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    float b = 2.0f * (fx * d[0] + fy * d[1] + fz * d[2]);
    float c = fx * fx + fy * fy + fz * fz - sphere->radius * sphere->radius;
    float discriminant = b * b - 4.0f * a * c;
    if (!(discriminant >= 0.0f)) return false;
    float root = sqrt(discriminant);
    float near = (-b - root) / (2.0f * a), far = (-b + root) / (2.0f * a);
    *t = near > t_min ? near : far;
    return *t > t_min && *t <= t_max;
}
