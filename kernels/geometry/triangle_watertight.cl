// Ray against triangles without cracks (Woop, Benthin and Wald 2013, "Watertight Ray/Triangle Intersection", JCGT 2(1)).
//
// The ray is sheared onto the z axis; a vertex's sheared coordinates depend on the vertex and the ray alone, so both
// triangles at an edge see the same ones. The side of an edge is found by comparing its two products instead of
// subtracting them: both triangles form the same two products, and no compiler can contract a comparison. Equal
// products mean that the ray meets the edge, and count as inside on both sides, so no double precision is needed.
//
// t is a mean of the corners' t with weights of one sign, so it is right to rounding, and above 0, where all corners lie
// ahead, however small or thin the triangle. Where some do not, a hit closer than the rounding error of t is dropped
// (pbrt, 4th ed., 6.8.8): rays that leave a surface never meet it.
#include "geometry/wide.cl"
#include "vector.cl"

typedef struct {
    int kx, ky, kz;       // kz: the direction's largest component
    float sx, sy, sz;     // shear and scale
    float ox, oy, oz;     // the origin, permuted
} TriangleRay;

typedef struct { ireal kx, ky, kz; real sx, sy, sz, ox, oy, oz; } TriangleRays;   // the same for all lanes

static inline real component(real3 a, ireal axis) { return axis == 0 ? a.x : axis == 1 ? a.y : a.z; }

static inline TriangleRays triangle_rays(real3 origin, real3 direction) {
    real3 a = absolute3(direction);
    TriangleRays r;
    r.kz = ((a.z >= a.x) & (a.z >= a.y)) ? (ireal)(2) : a.y >= a.x ? (ireal)(1) : (ireal)(0);
    r.kx = r.kz == 2 ? (ireal)(0) : r.kz + 1;
    r.ky = r.kx == 2 ? (ireal)(0) : r.kx + 1;
    r.sz = 1.0f / component(direction, r.kz);
    r.sx = component(direction, r.kx) * r.sz;
    r.sy = component(direction, r.ky) * r.sz;
    r.ox = component(origin, r.kx);
    r.oy = component(origin, r.ky);
    r.oz = component(origin, r.kz);
    return r;
}

static inline TriangleRay triangle_ray(const TriangleRays *rays, const Ray *ray, int lane) {
    return (TriangleRay){LANE_INT(rays->kx, lane), LANE_INT(rays->ky, lane), LANE_INT(rays->kz, lane),
                         LANE(rays->sx, lane), LANE(rays->sy, lane), LANE(rays->sz, lane),
                         LANE(rays->ox, lane), LANE(rays->oy, lane), LANE(rays->oz, lane)};
}

typedef struct { wide sx, sy, sz, ox, oy, oz; } ShearedRay;

// Corners with permuted components, one triangle in each lane against one ray, or one for all lanes against a ray in each.
static inline WideHit intersect_sheared(const wide p0[3], const wide p1[3], const wide p2[3], const ShearedRay *ray,
                                        wide t_max) {
    wide az = p0[2] - ray->oz, bz = p1[2] - ray->oz, cz = p2[2] - ray->oz;
    wide ax = fma(-ray->sx, az, p0[0] - ray->ox), ay = fma(-ray->sy, az, p0[1] - ray->oy);
    wide bx = fma(-ray->sx, bz, p1[0] - ray->ox), by = fma(-ray->sy, bz, p1[1] - ray->oy);
    wide cx = fma(-ray->sx, cz, p2[0] - ray->ox), cy = fma(-ray->sy, cz, p2[1] - ray->oy);

    wide u1 = cx * by, u2 = cy * bx;
    wide v1 = ax * cy, v2 = ay * cx;
    wide w1 = bx * ay, w2 = by * ax;
    wide_mask front = (u1 >= u2) & (v1 >= v2) & (w1 >= w2);
    wide_mask back = (u1 <= u2) & (v1 <= v2) & (w1 <= w2);
    WideHit result;
    result.hit = front | back;
    if (!WIDE_ANY(result.hit)) return result;

    wide u = u1 - u2, v = v1 - v2, w = w1 - w2;
    wide det = u + v + w;
    wide inverse = 1.0f / det;
    wide ta = az * ray->sz, tb = bz * ray->sz, tc = cz * ray->sz;
    result.t = (u * ta + v * tb + w * tc) * inverse;
    result.hit = result.hit & (result.t > 0.0f) & (result.t <= t_max) & (det != 0.0f);
    if (!WIDE_ANY(result.hit)) return result;
    result.u = v * inverse;
    result.v = w * inverse;

    wide_mask beside = result.hit & ((ta <= 0.0f) | (tb <= 0.0f) | (tc <= 0.0f));
    if (!WIDE_ANY(beside)) return result;
    wide max_x = wide_max3(WIDE_ABS(ax), WIDE_ABS(bx), WIDE_ABS(cx));
    wide max_y = wide_max3(WIDE_ABS(ay), WIDE_ABS(by), WIDE_ABS(cy));
    wide max_z = wide_max3(WIDE_ABS(az), WIDE_ABS(bz), WIDE_ABS(cz));
    wide max_e = wide_max3(WIDE_ABS(u), WIDE_ABS(v), WIDE_ABS(w));
    wide delta_x = GAMMA(5) * (max_x + max_z), delta_y = GAMMA(5) * (max_y + max_z);
    wide delta_e = 2.0f * (GAMMA(2) * max_x * max_y + delta_y * max_x + delta_x * max_y);
    max_z *= WIDE_ABS(ray->sz);
    wide t_min = 3.0f * (GAMMA(3) * max_e * max_z + delta_e * max_z + GAMMA(3) * max_z * max_e) * WIDE_ABS(inverse);
    result.hit = result.hit & ((result.t > t_min) | (beside == 0));
    return result;
}

static inline WideHit intersect_triangles(const TriangleRay *ray, global const Triangles *leaf, float t_max) {
    ShearedRay sheared = {ray->sx, ray->sy, ray->sz, ray->ox, ray->oy, ray->oz};
    wide p0[3] = {LOAD_WIDE(leaf->p0[ray->kx]), LOAD_WIDE(leaf->p0[ray->ky]), LOAD_WIDE(leaf->p0[ray->kz])};
    wide p1[3] = {LOAD_WIDE(leaf->p1[ray->kx]), LOAD_WIDE(leaf->p1[ray->ky]), LOAD_WIDE(leaf->p1[ray->kz])};
    wide p2[3] = {LOAD_WIDE(leaf->p2[ray->kx]), LOAD_WIDE(leaf->p2[ray->ky]), LOAD_WIDE(leaf->p2[ray->kz])};
    return intersect_sheared(p0, p1, p2, &sheared, t_max);
}
