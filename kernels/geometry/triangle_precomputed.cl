// Ray–triangle test with precomputed edges and normal n = e1×e2 (Suchiński 2022, eq. 3.7): s = origin − p0, m = s×d,
// (t, u, v) = (n·s, m·e2, −m·e1)/(−n·d). Not watertight at edges: see the watertight test.
#include "geometry/plain_ray.cl"

static inline WideHit intersect_triangles(const TriangleRay *ray, global const Triangles *leaf, float t_max) {
    const float *d = ray->direction;
    wide nx = LOAD_WIDE(leaf->n[0]), ny = LOAD_WIDE(leaf->n[1]), nz = LOAD_WIDE(leaf->n[2]);
    wide sx = ray->origin[0] - LOAD_WIDE(leaf->p0[0]);
    wide sy = ray->origin[1] - LOAD_WIDE(leaf->p0[1]);
    wide sz = ray->origin[2] - LOAD_WIDE(leaf->p0[2]);
    wide mx = sy * d[2] - sz * d[1], my = sz * d[0] - sx * d[2], mz = sx * d[1] - sy * d[0];
    wide inverse = -1.0f / (nx * d[0] + ny * d[1] + nz * d[2]);
    wide u = mx * LOAD_WIDE(leaf->e2[0]) + my * LOAD_WIDE(leaf->e2[1]) + mz * LOAD_WIDE(leaf->e2[2]);
    wide v = mx * LOAD_WIDE(leaf->e1[0]) + my * LOAD_WIDE(leaf->e1[1]) + mz * LOAD_WIDE(leaf->e1[2]);
    return inside_triangle((nx * sx + ny * sy + nz * sz) * inverse, u * inverse, -v * inverse, t_max);
}
