// Watertight ray–triangle test (Woop, Benthin and Wald 2013, "Watertight Ray/Triangle Intersection", JCGT 2(1)).
//
// The ray is sheared onto the z axis; a vertex's sheared coordinates depend on the vertex and the ray alone, so both
// triangles at an edge use the same ones. The side of an edge is found by comparing its two products instead of
// subtracting them: both triangles form the same two products, and no compiler can contract a comparison. Rounding is
// monotonic, so only equal products leave the side undecided; then their rounding errors are compared, which are exact
// (fma). So every side is exact for the sheared corners, and a ray through the edge itself hits on both sides or on
// neither.
//
// t is a weighted mean of the corners' t with weights of one sign, so it is accurate to rounding, and above 0 if all
// corners are ahead, however small or thin the triangle. If some are not, and t may be mere rounding error, it is
// computed from the volume between origin and triangle in double-word arithmetic, whose sign is exact: rays that start
// next to a surface and leave it never hit it, and none passes through a sliver.
#include "geometry/wide.cl"
#include "geometry/twice.cl"
#include "core/vector.cl"

TWICE_OF(wide, TwiceWide, wide)

typedef struct {
    int kx, ky, kz;       // kz: axis of the direction's largest component
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

// Six times the volume between the ray's origin and a triangle: the determinant of the corners relative to the origin.
// A value within its own rounding counts as 0: six products of three components are summed, each accurate to about
// 2^-46.
static inline wide volume(const wide p0[3], const wide p1[3], const wide p2[3], const ShearedRay *ray) {
#define FROM_ORIGIN(p) {wide_difference(p[0], ray->ox), wide_difference(p[1], ray->oy), wide_difference(p[2], ray->oz)}
    TwiceWide a[3] = FROM_ORIGIN(p0), b[3] = FROM_ORIGIN(p1), c[3] = FROM_ORIGIN(p2);
    TwiceWide x = wide_product(a[0], wide_minor(b[1], b[2], c[1], c[2]));
    TwiceWide y = wide_product(a[1], wide_minor(b[2], b[0], c[2], c[0]));
    TwiceWide z = wide_product(a[2], wide_minor(b[0], b[1], c[0], c[1]));
    wide sum = wide_value(wide_sum(wide_sum(x, y), z));
#define FARTHEST(p) wide_max3(WIDE_ABS(p[0].hi), WIDE_ABS(p[1].hi), WIDE_ABS(p[2].hi))
    wide error = FARTHEST(a) * FARTHEST(b) * FARTHEST(c) * 5.6843419e-14f;   // 2^-44
    return WIDE_ABS(sum) > error ? sum : 0.0f;
}

// A corner in the ray's sheared frame: x and y across the ray, z along it.
typedef struct { wide x, y, z; } Sheared;

static inline Sheared shear(const wide p[3], const ShearedRay *ray) {
    wide z = p[2] - ray->oz;
    return (Sheared){fma(-ray->sx, z, p[0] - ray->ox), fma(-ray->sy, z, p[1] - ray->oy), z};
}

// The two products of each edge, the greater of which tells on which side of the edge the ray passes.
typedef struct { wide u1, u2, v1, v2, w1, w2; } Edges;

static inline Edges edges_of(const Sheared *a, const Sheared *b, const Sheared *c) {
    return (Edges){c->x * b->y, c->y * b->x, a->x * c->y, a->y * c->x, b->x * a->y, b->y * a->x};
}

static inline wide_mask inside_edges(const Edges *e) {
    return ((e->u1 >= e->u2) & (e->v1 >= e->v2) & (e->w1 >= e->w2)) | ((e->u1 <= e->u2) & (e->v1 <= e->v2) & (e->w1 <= e->w2));
}

static inline wide weighted(wide u, wide v, wide w, wide ta, wide tb, wide tc) { return fma(w, tc, fma(v, tb, u * ta)); }

// Result of the sheared test. open: t may be mere rounding error, and `settle` decides; inverse_det: 1 over twice the
// area.
typedef struct { WideHit hit; wide_mask open; wide inverse_det; } ShearedHit;

// The rounding error of t is at most T_ERROR·reach·(reach + slope·depth)·depth·|sz/det|. By pbrt (4th ed., 6.8.8) a
// sheared corner has an error of 5 u of reach + slope·depth, hence each of u, v, w of 24 u of reach·(reach +
// slope·depth), which depth·|sz/det| carries to t, thrice; with the sum's own roundings that makes 108 u.
#define T_ERROR (108.0f * UNIT_ROUNDOFF)
// A t behind the origin is accepted unless the triangle, seen along the ray, is so thin that the error of t may reach
// this fraction of the triangle's depth.
#define THIN 0.01f

static inline wide wide_far(wide x, wide y) { return WIDE_ABS(x) > WIDE_ABS(y) ? WIDE_ABS(x) : WIDE_ABS(y); }

// Corners with permuted components: one triangle per lane against one ray, or one triangle against a ray per lane.
__attribute__((always_inline))
static inline ShearedHit intersect_sheared(const wide p0[3], const wide p1[3], const wide p2[3], const ShearedRay *ray,
                                           wide t_max) {
    const Sheared a = shear(p0, ray), b = shear(p1, ray), c = shear(p2, ray);
    const Edges edges = edges_of(&a, &b, &c);
    ShearedHit result;
    result.hit.hit = inside_edges(&edges);
    result.open = (wide_mask)(0);
    if (!WIDE_ANY(result.hit.hit)) return result;

    wide u = edges.u1 - edges.u2, v = edges.v1 - edges.v2, w = edges.w1 - edges.w2;
    if (WIDE_ANY(result.hit.hit & (u * v * w == 0.0f))) {
        u = u == 0.0f ? fma(c.x, b.y, -edges.u1) - fma(c.y, b.x, -edges.u2) : u;
        v = v == 0.0f ? fma(a.x, c.y, -edges.v1) - fma(a.y, c.x, -edges.v2) : v;
        w = w == 0.0f ? fma(b.x, a.y, -edges.w1) - fma(b.y, a.x, -edges.w2) : w;
        result.hit.hit = ((u >= 0.0f) & (v >= 0.0f) & (w >= 0.0f)) | ((u <= 0.0f) & (v <= 0.0f) & (w <= 0.0f));
    }
    result.inverse_det = 1.0f / (u + v + w);   // infinite for a degenerate triangle, so that t is NaN
    wide ta = a.z * ray->sz, tb = b.z * ray->sz, tc = c.z * ray->sz;
    result.hit.t = weighted(u, v, w, ta, tb, tc) * result.inverse_det;
    result.hit.u = v * result.inverse_det;
    result.hit.v = w * result.inverse_det;
    wide_mask ahead = result.hit.hit & (result.hit.t > 0.0f);
    wide_mask beside = result.hit.hit & (wide_min3(ta, tb, tc) <= 0.0f) & (wide_max3(ta, tb, tc) >= 0.0f);
    result.hit.hit = ahead & (result.hit.t <= t_max);
    if (!WIDE_ANY(beside)) return result;
    wide_mask thin = WIDE_ABS(u + v + w) < THIN * wide_max3(WIDE_ABS(edges.u1), WIDE_ABS(edges.v1), WIDE_ABS(edges.w1));
    beside = beside & (ahead | thin);
    if (!WIDE_ANY(beside)) return result;
    wide reach = wide_max3(wide_far(a.x, a.y), wide_far(b.x, b.y), wide_far(c.x, c.y));
    wide depth = wide_max3(WIDE_ABS(a.z), WIDE_ABS(b.z), WIDE_ABS(c.z));
    wide error = T_ERROR * reach * (reach + wide_far(ray->sx, ray->sy) * depth) * WIDE_ABS(result.inverse_det);
    result.open = beside & (WIDE_ABS(result.hit.t) <= error * depth * WIDE_ABS(ray->sz))
                & ((result.hit.t > 0.0f) | (error > THIN));
    return result;
}

// The hits, with t in double-word arithmetic if it is undecided. Rarely called, so it recomputes everything: passing on
// known values would force all tests to store them in memory.
static inline WideHit settle(const wide p0[3], const wide p1[3], const wide p2[3], const ShearedRay *ray, wide t_max) {
    ShearedHit sheared = intersect_sheared(p0, p1, p2, ray, t_max);
    WideHit result = sheared.hit;
    wide t = -ray->sz * sheared.inverse_det * volume(p0, p1, p2, ray);
    result.t = sheared.open ? t : result.t;
    result.hit = sheared.open ? (t > 0.0f) & (t <= t_max) : result.hit;
    return result;
}

#define PACK_CORNER(p) {LOAD_WIDE(leaf->p[ray->kx]), LOAD_WIDE(leaf->p[ray->ky]), LOAD_WIDE(leaf->p[ray->kz])}
#define PACK_CORNERS wide p0[3] = PACK_CORNER(p0), p1[3] = PACK_CORNER(p1), p2[3] = PACK_CORNER(p2); \
    ShearedRay sheared_ray = {ray->sx, ray->sy, ray->sz, ray->ox, ray->oy, ray->oz};

__attribute__((noinline)) static WideHit settle_triangles(const TriangleRay *ray, global const Triangles *leaf,
                                                          float t_max) {
    PACK_CORNERS
    return settle(p0, p1, p2, &sheared_ray, t_max);
}

static inline WideHit intersect_triangles(const TriangleRay *ray, global const Triangles *leaf, float t_max) {
    PACK_CORNERS
    ShearedHit sheared = intersect_sheared(p0, p1, p2, &sheared_ray, t_max);
    WideHit found = sheared.hit;
    if (WIDE_ANY(sheared.open)) {
        WideHit settled = settle_triangles(ray, leaf, t_max);
        found.t = settled.t;
        found.hit = settled.hit;
    }
    return found;
}
