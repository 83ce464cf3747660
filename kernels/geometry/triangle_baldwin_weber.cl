// Ray–triangle test by the transformation that maps each triangle to the unit triangle in the plane w = 0 (Baldwin and
// Weber 2016, "Fast Ray-Triangle Intersections by Coordinate Transformation", JCGT 5(3)): the rows u, v, w of the map
// are stored. Not watertight at edges, and imprecise far from the coordinates' origin, since nothing is subtracted from
// the ray's origin before it is multiplied.
#include "geometry/plain_ray.cl"

#define ROW_DOT(row, a) (LOAD_WIDE(leaf->row[0]) * a[0] + LOAD_WIDE(leaf->row[1]) * a[1] + LOAD_WIDE(leaf->row[2]) * a[2])

static inline WideHit intersect_triangles(const TriangleRay *ray, global const Triangles *leaf, float t_max) {
    const float *o = ray->origin, *d = ray->direction;
    wide t = -(ROW_DOT(w, o) + LOAD_WIDE(leaf->w[3])) / ROW_DOT(w, d);
    wide u = t * ROW_DOT(u, d) + ROW_DOT(u, o) + LOAD_WIDE(leaf->u[3]);
    wide v = t * ROW_DOT(v, d) + ROW_DOT(v, o) + LOAD_WIDE(leaf->v[3]);
    return inside_triangle(t, u, v, t_max);
}
