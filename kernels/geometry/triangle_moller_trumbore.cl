// Ray–triangle test with the least memory and arithmetic (Möller and Trumbore 1997; Suchiński 3.6, Nadolny 1.15): q =
// d×e2, r = s×e1, (t, u, v) = (r·e2, q·s, r·d)/(q·e1). Not watertight at edges: see the watertight test.
#include "geometry/plain_ray.cl"

static inline WideHit intersect_triangles(const TriangleRay *ray, global const Triangles *leaf, float t_max) {
    const float *d = ray->direction;
    wide p0x = LOAD_WIDE(leaf->p0[0]), p0y = LOAD_WIDE(leaf->p0[1]), p0z = LOAD_WIDE(leaf->p0[2]);
    wide e1x = LOAD_WIDE(leaf->p1[0]) - p0x, e1y = LOAD_WIDE(leaf->p1[1]) - p0y, e1z = LOAD_WIDE(leaf->p1[2]) - p0z;
    wide e2x = LOAD_WIDE(leaf->p2[0]) - p0x, e2y = LOAD_WIDE(leaf->p2[1]) - p0y, e2z = LOAD_WIDE(leaf->p2[2]) - p0z;
    wide sx = ray->origin[0] - p0x, sy = ray->origin[1] - p0y, sz = ray->origin[2] - p0z;
    wide qx = d[1] * e2z - d[2] * e2y, qy = d[2] * e2x - d[0] * e2z, qz = d[0] * e2y - d[1] * e2x;
    wide rx = sy * e1z - sz * e1y, ry = sz * e1x - sx * e1z, rz = sx * e1y - sy * e1x;
    wide inverse = 1.0f / (qx * e1x + qy * e1y + qz * e1z);
    return inside_triangle((rx * e2x + ry * e2y + rz * e2z) * inverse, (qx * sx + qy * sy + qz * sz) * inverse,
                           (rx * d[0] + ry * d[1] + rz * d[2]) * inverse, t_max);
}
