// Binning: compute the outline of each primitive that a camera sees, and the bins that it overlaps.
//
// Points are relative to the eye. The image position (sx, sy), as in integrator/camera_rays.cl, is in the direction
// sx·right − sy·up + forward. The plane through the eye and two corners a, b cuts the image in a line, on whose two
// sides the edge function (a × b)·direction, a function e0·sx + e1·sy + e2, has opposite signs; and with a triangle's
// normal N, 1 over the distance at which that direction hits its plane is N·direction/N·corner, another such function.
// That holds wherever the corners are, so no clipping is needed: anything behind the eye is on the wrong side of some
// edge (Olano and Greer 1997, "Triangle Scan Conversion using 2D Homogeneous Coordinates").
//
// Both triangles at an edge use its corners in the same order and multiply by explicit fma: they compute the same
// function up to its sign, so no image position falls between them.
#include "core/vector.cl"
#include "raster/bins.cl"

#define SLACK 0.0625f   // of bounds, in pixels: far more than the rounding of edges
#define MOST_BINS 64    // of one size in which a primitive is entered, unless it is too large for any

typedef struct { real3 eye, right, up, forward, per_right, per_up; } View;   // per_…: divided by their squared lengths

static inline View view_of(const Launch *launch) {
    real3 right = broadcast(launch->right), up = broadcast(launch->up);
    return (View){broadcast(launch->position), right, up, broadcast(launch->forward),
                  scale(right, 1.0f / dot3(right, right)), scale(up, 1.0f / dot3(up, up))};
}

static inline real exact_dot3(real3 a, real3 b) { return fma(a.x, b.x, fma(a.y, b.y, a.z * b.z)); }

// v·direction as a function of (sx, sy).
static inline real3 along_view(const View *view, real3 v) {
    return vector(exact_dot3(v, view->right), -exact_dot3(v, view->up), exact_dot3(v, view->forward));
}

static inline real3 edge_between(const View *view, real3 a, real3 b) {
    ireal turned = (b.x < a.x) | ((b.x == a.x) & ((b.y < a.y) | ((b.y == a.y) & (b.z < a.z))));
    real3 p = choose(turned, b, a), q = choose(turned, a, b);
    real3 edge = along_view(view, vector(fma(p.y, q.z, -(p.z * q.y)), fma(p.z, q.x, -(p.x * q.z)),
                                         fma(p.x, q.y, -(p.y * q.x))));
    return choose(turned, negate(edge), edge);
}

// Conservative bounds of a primitive, in pixels.
typedef struct { real left, right, top, bottom; ireal visible; } Bounds;

// Extend the bounds along one axis of the image by the corners a, b, at depths w, v; an edge between a corner ahead and
// one that is not extends to infinity. rounding: of the depths.
static inline void widen(real a, real w, real b, real v, real rounding, real *low, real *high) {
    ireal ahead = w > 0.0f, goes = ahead != (v > 0.0f);
    real at = a / w, towards = ahead ? b * w - a * v : a * v - b * w, error = rounding * (absolute(a) + absolute(b));
    *low = (ahead & (at < *low)) ? at : *low;
    *high = (ahead & (at > *high)) ? at : *high;
    *low = (goes & !(towards > error)) ? (real)(-INFINITY) : *low;
    *high = (goes & !(towards < -error)) ? (real)(INFINITY) : *high;
}

static inline Bounds in_pixels(const Launch *launch, real left, real right, real top, real bottom, ireal visible) {
    real across = 0.5f * (float)launch->width, down = 0.5f * (float)launch->height, reach = SLACK + FILTER_REACH;
    Bounds bounds = {left * across + across - reach, right * across + across + reach, top * down + down - reach,
                     bottom * down + down + reach, visible};
    bounds.visible = visible & (bounds.right > 0.0f) & (bounds.left < (float)launch->width) & (bounds.bottom > 0.0f)
                   & (bounds.top < (float)launch->height);
    return bounds;
}

// The outlines of all lanes: the members of an Outline, without its ids; for spheres edge0 is the centre and edge1.x
// the radius.
typedef struct { real3 edge0, edge1, edge2, nearness; Bounds bounds; } Outlines;

#if TRIANGLES
// Transform a mesh's vector or point to the world.
static inline real3 placed(const Scene *scene, ireal instance, real3 v, bool moved) {
#if INSTANCES
#define MOVED(row) (moved ? GATHER(real, scene->placements, instance, .to_world[row][3]) : ZERO)
    return vector(exact_dot3(GATHER3(scene->placements, instance, .to_world[0]), v) + MOVED(0),
                  exact_dot3(GATHER3(scene->placements, instance, .to_world[1]), v) + MOVED(1),
                  exact_dot3(GATHER3(scene->placements, instance, .to_world[2]), v) + MOVED(2));
#else
    return v;
#endif
}

static inline Outlines triangle_outlines(const Scene *scene, const Launch *launch, const View *view, ireal triangle,
                                         ireal instance) {
    real3 p0 = GATHER3(scene->triangles, triangle, .p0);
    real3 p1 = GATHER3(scene->triangles, triangle, .p1);
    real3 p2 = GATHER3(scene->triangles, triangle, .p2);
    real3 e1 = placed(scene, instance, sub(p1, p0), false), e2 = placed(scene, instance, sub(p2, p0), false);
    p0 = sub(placed(scene, instance, p0, true), view->eye);
    p1 = sub(placed(scene, instance, p1, true), view->eye);
    p2 = sub(placed(scene, instance, p2, true), view->eye);
    real3 n = cross3(scale(e1, 1.0f / largest(absolute3(e1))), scale(e2, 1.0f / largest(absolute3(e2))));
    real d0 = dot3(p0, p0), d1 = dot3(p1, p1), d2 = dot3(p2, p2);
    real3 nearest = choose((d0 <= d1) & (d0 <= d2), p0, choose(d1 <= d2, p1, p2));   // rounding is smallest there
    real distance = exact_dot3(n, nearest);
    real side = distance < 0.0f ? (real)(-1.0f) : ONE;   // makes edge functions positive inside on either side
    Outlines outlines;
    outlines.nearness = scale(along_view(view, n), 1.0f / distance);
    outlines.edge0 = scale(edge_between(view, p1, p2), side);
    outlines.edge1 = scale(edge_between(view, p2, p0), side);
    outlines.edge2 = scale(edge_between(view, p0, p1), side);

    real w0 = exact_dot3(p0, view->forward), w1 = exact_dot3(p1, view->forward), w2 = exact_dot3(p2, view->forward);
    real x0 = exact_dot3(p0, view->per_right), x1 = exact_dot3(p1, view->per_right), x2 = exact_dot3(p2, view->per_right);
    real y0 = -exact_dot3(p0, view->per_up), y1 = -exact_dot3(p1, view->per_up), y2 = -exact_dot3(p2, view->per_up);
    real rounding = 16.0f * UNIT_ROUNDOFF * maximum(largest(absolute3(p0)), maximum(largest(absolute3(p1)),
                                                                                    largest(absolute3(p2))));
    real left = (real)(INFINITY), right = (real)(-INFINITY), top = left, bottom = right;
    widen(x0, w0, x1, w1, rounding, &left, &right);
    widen(x1, w1, x2, w2, rounding, &left, &right);
    widen(x2, w2, x0, w0, rounding, &left, &right);
    widen(y0, w0, y1, w1, rounding, &top, &bottom);
    widen(y1, w1, y2, w2, rounding, &top, &bottom);
    widen(y2, w2, y0, w0, rounding, &top, &bottom);
    ireal ahead = (w0 > 0.0f) | (w1 > 0.0f) | (w2 > 0.0f);
    ireal faces = absolute(distance) > 0.0f;   // neither edge-on nor degenerate
    outlines.bounds = in_pixels(launch, left, right, top, bottom, ahead & faces);
    return outlines;
}
#endif

#if SPHERES
// Bounds along one axis: the lines through the eye tangent to the circle around (a, w); unbounded unless it is well
// ahead.
static inline void touch(real a, real w, real radius, real *low, real *high) {
    real below = (w - radius) * (w + radius), root = radius * sqrt(a * a + below);
    real q = a * w + (a < 0.0f ? -root : root), far = q / below, near = (a - radius) * (a + radius) / q;
    ireal ahead = w - radius > 1e-3f * radius;
    *low = ahead ? minimum(far, near) : (real)(-INFINITY);
    *high = ahead ? maximum(far, near) : (real)(INFINITY);
}

static inline Outlines sphere_outlines(const Scene *scene, const Launch *launch, const View *view, ireal sphere) {
    Outlines outlines;
    outlines.edge0 = GATHER3(scene->spheres, sphere, .center);
    outlines.edge1 = splat(GATHER(real, scene->spheres, sphere, .radius));
    outlines.edge2 = outlines.nearness = splat(ZERO);
    real3 p = sub(outlines.edge0, view->eye);
    real radius = outlines.edge1.x, w = dot3(p, view->forward), across = length3(view->right), up = length3(view->up);
    real left, right, top, bottom;
    touch(dot3(p, view->right) / across, w, radius, &left, &right);
    touch(-dot3(p, view->up) / up, w, radius, &top, &bottom);
    outlines.bounds = in_pixels(launch, left / across, right / across, top / up, bottom / up, w > -radius);
    return outlines;
}
#endif

// Whether any part of a bin is on the inner side of an edge.
static inline bool reaches(const float edge[3], float left, float right, float top, float bottom) {
    return edge[0] * (edge[0] > 0.0f ? right : left) + edge[1] * (edge[1] > 0.0f ? bottom : top) + edge[2] >= 0.0f;
}

// Count an outline in the bins that it overlaps, or enter its index there.
static inline void sort_in(const Launch *launch, const Outline *outline, uint left, uint right, uint number, uint fill,
                           global uint *bins, global uint *entries) {
    uint x0 = left / TILE, x1 = right / TILE;
    uint y0 = outline->first_row / TILE, y1 = outline->last_row / TILE, level = 0;
    while (level + 1 < BIN_LEVELS && (x1 - x0 + 1) * (y1 - y0 + 1) > MOST_BINS) {
        x0 >>= BIN_SHIFT, x1 >>= BIN_SHIFT, y0 >>= BIN_SHIFT, y1 >>= BIN_SHIFT;
        ++level;
    }
    BinLevel size = bin_level(launch, level);
    float across = 2.0f / launch->width, down = 2.0f / launch->height, reach = SLACK + FILTER_REACH;
    float side = TILE << (BIN_SHIFT * level);
    for (uint y = y0; y <= y1; ++y) {
        float top = (y * side - reach) * down - 1.0f, bottom = ((y + 1) * side + reach) * down - 1.0f;
        for (uint x = x0; x <= x1; ++x) {
            float first = (x * side - reach) * across - 1.0f, last = ((x + 1) * side + reach) * across - 1.0f;
            if (outline->instance >= 0 && !(reaches(outline->edge0, first, last, top, bottom)
                                          && reaches(outline->edge1, first, last, top, bottom)
                                          && reaches(outline->edge2, first, last, top, bottom))) continue;
            uint place = atomic_inc(bins + size.first + y * size.across + x);
            if (fill) entries[place] = number;
        }
    }
}

static inline void put3(float *row, const real3 *value, int lane) {
    row[0] = LANE(value->x, lane);
    row[1] = LANE(value->y, lane);
    row[2] = LANE(value->z, lane);
}

#if INSTANCES
// The instance of triangle number `drawn` among all that are drawn; starts: of each instance's triangles.
static inline ireal instance_of(global const uint *starts, uint places, ureal drawn) {
    ureal instance = (ureal)(0);
    for (uint step = 1u << (31 - clz(places)); step; step >>= 1) {
        ureal next = instance + step;
        ireal exists = next < places;
        instance = (exists & (GATHER(ureal, starts, exists ? next : instance, ) <= drawn)) ? next : instance;
    }
    return AS_INT(instance);
}
#endif

// The pixel of a position along an axis of `pixels` pixels, clamped.
static inline uint within(float place, uint pixels) {
    return place > 0.0f ? (uint)(place < pixels - 1 ? place : pixels - 1) : 0;
}

#define SORTED_PARAMETERS uint fill, global uint *numbers, global uint *bins, global uint *entries, global Outline *outlines

// Number the visible outlines of the lanes consecutively, and count them in the bins that they overlap; with `fill`
// they are entered there, from bins[i] on, and stored. instance: below 0 for spheres.
static inline void sort_lanes(const Launch *launch, const Outlines *seen, ireal active, ireal primitive, ireal instance,
                              SORTED_PARAMETERS) {
    ireal visible = active & seen->bounds.visible;
    uint count = 0;
    for (int lane = 0; lane < LANES; ++lane) count += LANE_INT(visible, lane) != 0;
    if (count == 0) return;
    uint number = atomic_add(numbers, count);
    for (int lane = 0; lane < LANES; ++lane) {
        if (!LANE_INT(visible, lane)) continue;
        Outline outline;
        put3(outline.edge0, &seen->edge0, lane);
        put3(outline.edge1, &seen->edge1, lane);
        put3(outline.edge2, &seen->edge2, lane);
        put3(outline.nearness, &seen->nearness, lane);
        outline.primitive = LANE_INT(primitive, lane);
        outline.instance = LANE_INT(instance, lane);
        outline.first_row = within(LANE(seen->bounds.top, lane), launch->height);
        outline.last_row = within(LANE(seen->bounds.bottom, lane), launch->height);
        sort_in(launch, &outline, within(LANE(seen->bounds.left, lane), launch->width),
                within(LANE(seen->bounds.right, lane), launch->width), number, fill, bins, entries);
        if (fill) outlines[number] = outline;
        ++number;
    }
}

#define SORT_PARAMETERS uint count, uint block, SCENE_PARAMETERS, const Launch launch, SORTED_PARAMETERS
#define FOR_DRAWN \
    Scene scene = SCENE_ARGUMENTS; \
    View view = view_of(&launch); \
    uint begin = (uint)get_global_id(0) * block, end = begin + block < count ? begin + block : count; \
    for (uint i = begin; i < end; i += LANES)

#if TRIANGLES
// starts: for each of `places` instances, the number of triangles before it.
kernel void sort_triangles(SORT_PARAMETERS, global const uint *starts, uint places) {
    FOR_DRAWN {
        ureal drawn = i + LANE_INDEX;
        ireal active = drawn < end, instance = (ireal)(0);
        drawn = active ? drawn : (ureal)(i);
#if INSTANCES
        instance = instance_of(starts, places, drawn);
        drawn -= GATHER(ureal, starts, instance, );
        ireal triangle = AS_INT(drawn) + GATHER(ireal, scene.placements, instance, .first);
#else
        ireal triangle = AS_INT(drawn);
#endif
        Outlines seen = triangle_outlines(&scene, &launch, &view, triangle, instance);
        sort_lanes(&launch, &seen, active, AS_INT(drawn), instance, fill, numbers, bins, entries, outlines);
    }
}
#endif

#if SPHERES
kernel void sort_spheres(SORT_PARAMETERS) {
    FOR_DRAWN {
        ureal drawn = i + LANE_INDEX;
        ireal active = drawn < end;
        ireal sphere = AS_INT(active ? drawn : (ureal)(i)), primitive = sphere + scene.counts.triangles;
#if INSTANCES
        primitive -= RECORD(scene.placements, 0)->first;   // relative to the geometry without instancing
#endif
        Outlines seen = sphere_outlines(&scene, &launch, &view, sphere);
        sort_lanes(&launch, &seen, active, primitive, (ireal)(-1), fill, numbers, bins, entries, outlines);
    }
}
#endif
