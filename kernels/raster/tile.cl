// Rasterise a tile: for each sample position the nearest primitive in the bins of the tile (raster/outline.cl); of
// equally near ones the first, whatever the order of entries.
//
// A work-item takes ROWS times LANES pixels: on a CPU a whole tile, so that each outline is read once per tile.
#include "integrator/camera_rays.cl"
#include "surface/surface.cl"
#include "raster/bins.cl"
#include SPHERE_TEST

#if LANES == 1
#define ROWS 1
#define ROW_HEIGHT 1
#else
#define ROWS (TILE * TILE / LANES)
#define ROW_HEIGHT (LANES / TILE)
#endif

typedef struct {
    global const uint *starts, *entries;
    global const Outline *outlines;
} Bins;

#define BIN_PARAMETERS global const uint *bin_starts, global const uint *bin_entries, global const Outline *bin_outlines
#define BIN_ARGUMENTS {bin_starts, bin_entries, bin_outlines}

// LANES sample positions of a tile, their camera rays, and the nearest primitive found so far.
typedef struct {
    real2 place;
    CameraRay ray;
    real length;               // of the direction scaled to a depth of 1
    ireal active;
    real nearness;             // 1/depth along the viewing direction
    real edge0, edge1, edge2;  // edge functions of a triangle
    ireal primitive, instance;
#if SPHERES
    real t;                    // of a sphere, else 0
#endif
} Row;

static inline Row row_of(const Launch *launch, real2 place, CameraRay ray, ireal active) {
    Row row;
    row.place = place;
    row.ray = ray;
    row.length = 1.0f / dot3(ray.direction, broadcast(launch->forward));
    row.active = active;
    row.nearness = row.edge0 = row.edge1 = row.edge2 = ZERO;
    row.primitive = (ireal)(-1);
    row.instance = (ireal)(0);
#if SPHERES
    row.t = ZERO;
#endif
    return row;
}

// Whether an outline is nearer than the current one; of equals the first counts.
static inline ireal is_first(const Row *row, real nearness, int primitive, int instance) {
    ireal before = (instance < row->instance) | ((instance == row->instance) & (primitive < row->primitive));
    return (nearness > row->nearness) | ((nearness == row->nearness) & before);
}

#if TRIANGLES
static inline real at_place(global const float *function, real2 place) {
    return fma((real)(function[0]), place.x, fma((real)(function[1]), place.y, (real)(function[2])));
}

static inline void rasterize_triangle(global const Outline *outline, Row *row) {
    real edge0 = at_place(outline->edge0, row->place), edge1 = at_place(outline->edge1, row->place);
    real edge2 = at_place(outline->edge2, row->place), nearness = at_place(outline->nearness, row->place);
    ireal inside = minimum(minimum(edge0, edge1), minimum(edge2, nearness - row->nearness)) >= 0.0f;
    if (!ANY(inside)) return;
    inside = inside & row->active & is_first(row, nearness, outline->primitive, outline->instance);
    row->nearness = inside ? nearness : row->nearness;
    row->edge0 = inside ? edge0 : row->edge0;
    row->edge1 = inside ? edge1 : row->edge1;
    row->edge2 = inside ? edge2 : row->edge2;
    row->primitive = inside ? (ireal)(outline->primitive) : row->primitive;
    row->instance = inside ? (ireal)(outline->instance) : row->instance;
#if SPHERES
    row->t = inside ? ZERO : row->t;
#endif
}
#endif

#if SPHERES
SPHERE_OF(real, ireal, TwiceSeen, seen)

static inline void rasterize_sphere(global const Outline *outline, Row *row) {
    const real origin[3] = {row->ray.origin.x, row->ray.origin.y, row->ray.origin.z};
    const real direction[3] = {row->ray.direction.x, row->ray.direction.y, row->ray.direction.z};
    const real from[3] = {origin[0] - outline->edge0[0], origin[1] - outline->edge0[1], origin[2] - outline->edge0[2]};
    ireal hit = row->active & seen_may_hit(from, direction, outline->edge1[0]);
    if (!ANY(hit)) return;
    real near, far;
    seen_roots(origin, direction, outline->edge0, outline->edge1[0], &near, &far);
    real t = near > 0.0f ? near : far, nearness = row->length / t;
    hit = hit & is_first(row, nearness, outline->primitive, 0);
    row->nearness = hit ? nearness : row->nearness;
    row->t = hit ? t : row->t;
    row->primitive = hit ? (ireal)(outline->primitive) : row->primitive;
    row->instance = hit ? (ireal)(0) : row->instance;
}
#endif

// Rasterise all primitives in the bins of a tile for `count` rows; (x, y): the first pixel of the first row.
static inline void rasterise(const Bins *bins, const Launch *launch, uint x, uint y, Row *rows,
                             int count) {
    for (uint level = 0; level < BIN_LEVELS; ++level) {
        BinLevel size = bin_level(launch, level);
        uint bin = size.first + (y / TILE >> BIN_SHIFT * level) * size.across + (x / TILE >> BIN_SHIFT * level);
        uint end = bins->starts[bin + 1];
        for (uint i = bins->starts[bin]; i < end; ++i) {
            global const Outline *outline = bins->outlines + bins->entries[i];
            int above = outline->first_row - (int)y, below = outline->last_row - (int)y;
            if (below < 0) continue;
            int last = below / ROW_HEIGHT < count ? below / ROW_HEIGHT : count - 1;
            for (int row = above > 0 ? above / ROW_HEIGHT : 0; row <= last; ++row) {
#if TRIANGLES && SPHERES
                if (outline->instance >= 0) rasterize_triangle(outline, rows + row);
                else rasterize_sphere(outline, rows + row);
#elif TRIANGLES
                rasterize_triangle(outline, rows + row);
#else
                rasterize_sphere(outline, rows + row);
#endif
            }
        }
    }
}

static inline Hits row_hits(const Row *row) {
    real t = row->length / row->nearness, whole = row->edge0 + row->edge1 + row->edge2;
    whole = whole > 0.0f ? 1.0f / whole : ZERO;
#if SPHERES
    t = row->t > 0.0f ? row->t : t;
#endif
    return (Hits){t, row->edge1 * whole, row->edge2 * whole, row->primitive, row->instance};
}
