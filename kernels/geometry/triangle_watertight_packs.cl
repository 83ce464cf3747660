// One ray against all triangles of a scene with few, in packs: as geometry/triangle_watertight.cl, but cheaper if no
// decision is close. Packs that the ray's line misses cost no division; hits cost no branch.
//
// Left to the exact test: a ray through an edge, a t that may be mere rounding error, and two hits at the same t in a
// lane, as packs are unordered. The threshold below which a volume is mere rounding error is computed once per ray, for
// corners as far away as any in the scene.
#include "geometry/triangle_watertight.cl"

#define HALVES (PACK_SIZE / WIDTH)
#define LAST_BIT 31

// Packs are chosen by one bit each; the last bit stands for all packs from there on.
static inline bool is_chosen(uint chosen, int pack) { return chosen >> (pack < LAST_BIT ? pack : LAST_BIT) & 1; }

// The triangles that are tested i-th: a pack, or half of one, whose rows start at an offset.
static inline global const Triangles *pack_at(ARRAY(Triangles) packs, int i) {
    return (global const Triangles *)((global const float *)RECORD(packs, i / HALVES) + i % HALVES * WIDTH);
}

static inline float wide_least(wide x) {
#if WIDTH == 8
    float8 eight = x;
#else
    float8 lo = vload8(0, (const float *)&x), hi = vload8(1, (const float *)&x), eight = lo < hi ? lo : hi;
#endif
    float4 four = eight.lo < eight.hi ? eight.lo : eight.hi;
    float2 two = four.lo < four.hi ? four.lo : four.hi;
    return two.x < two.y ? two.x : two.y;
}

// Whether hits at t come after the last one, if NEXT_HIT.
static inline wide_mask comes_next(const Ray *ray, global const Triangles *leaf, wide t) {
#if NEXT_HIT
    return (t > ray->after_t) | ((t == ray->after_t) & (LOAD_WIDE(leaf->primitive) > ray->after_primitive));
#else
    return (wide_mask)(-1);
#endif
}

// Find the closest hit, or any, in the chosen packs. Return false if that is undecided.
static inline bool intersect_packs(const TriangleRay *ray, const Ray *whole, ARRAY(Triangles) packs, uint chosen,
                                   const bool stop_at_first, Hit *hit) {
    // As in intersect_sheared, with reach <= 2 far and depth <= far.
    float far = RECORD(packs, 0)->extent + fabs(ray->ox) + fabs(ray->oy) + fabs(ray->oz);
    float error = T_ERROR * 6.0f * far * far, rounding = error * far * fabs(ray->sz), thin = error / THIN;
    // An earlier hit has a primitive after all of these, so it yields to one at the same t.
    wide t = hit->primitive < 0 ? hit->t : as_float(as_int(hit->t) + 1), u = 0.0f, v = 0.0f;
    wide_mask pack = (wide_mask)(-1), open = (wide_mask)(0);
    for (int i = 0; i < RECORD(packs, 0)->count * HALVES; ++i) {
        if (!is_chosen(chosen, i / HALVES)) continue;
        global const Triangles *leaf = pack_at(packs, i);
        PACK_CORNERS
        const Sheared a = shear(p0, &sheared_ray), b = shear(p1, &sheared_ray), c = shear(p2, &sheared_ray);
        const Edges edges = edges_of(&a, &b, &c);
        wide_mask inside = inside_edges(&edges);
        if (!WIDE_ANY(inside)) continue;
        wide at_a = edges.u1 - edges.u2, at_b = edges.v1 - edges.v2, at_c = edges.w1 - edges.w2, det = at_a + at_b + at_c;
        wide inverse = 1.0f / det;
        wide volume = weighted(at_a, at_b, at_c, a.z * ray->sz, b.z * ray->sz, c.z * ray->sz);
        wide pack_t = volume * inverse;
        wide_mask ahead = pack_t > 0.0f, next = comes_next(whole, leaf, pack_t);
        wide_mask beside = ((WIDE_BITS(a.z) ^ WIDE_BITS(b.z)) | (WIDE_BITS(a.z) ^ WIDE_BITS(c.z))) < 0;
        open |= inside & ((at_a * at_b * at_c == 0.0f)
                          | (ahead & next & (pack_t == t))
                          | (beside & (WIDE_ABS(volume) <= rounding) & (ahead | (WIDE_ABS(det) < thin))));
        wide_mask closer = inside & ahead & next & (pack_t < t);
        t = closer ? pack_t : t;
        u = closer ? at_b * inverse : u;
        v = closer ? at_c * inverse : v;
        pack = closer ? (wide_mask)(i) : pack;
    }
    uint found = wide_bits(pack >= 0);
    if (WIDE_ANY(open)) return false;
    if (!found) return true;
    if (stop_at_first) {
        hit->primitive = 0;
        return true;
    }
    float least = wide_least(t);
    found &= wide_bits(t == (wide)(least));
    hit->t = least;
    hit->primitive = INT_MAX;
    for (; found; found &= found - 1) {
        int i = first_bit(found), primitive = pack_at(packs, ((const int *)&pack)[i])->primitive[i];
        if (primitive > hit->primitive) continue;
        hit->primitive = primitive;
        hit->u = ((const float *)&u)[i];
        hit->v = ((const float *)&v)[i];
    }
    return true;
}
