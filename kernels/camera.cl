// Pinhole camera (Suchiński 3.1, Nadolny algorithm 2): d = a·f·(2x/w − 1)·r − f·(2y/h − 1)·u + v, normalised, with
// (x, y) drawn from the filter around the pixel's middle, f = tan(fov/2), a = w/h. World frame; the host folds a·f and f
// into right and up.
#include "sampler.cl"
#include "vector.cl"
#include FILTER

// What the lanes of a work-item see: LANES pixels of a tile of TILE x TILE. A launch takes those from first_pixel on,
// counted tile by tile as `tiles` lists them, row by row in each. A lane past the picture's edge is given its first lane's
// pixel and is not `inside`.
typedef struct {
    ureal index, x, y, code;   // index: of the pixel in the picture
    ireal inside;
} LanePixels;

// False where there are none.
static inline bool lane_pixels(const Launch *launch, global const uint *tiles, LanePixels *p) {
    uint first = (uint)get_global_id(0) * LANES;
    if (first >= launch->pixel_count) return false;
    first += launch->first_pixel;
    uint across = (launch->width + TILE - 1) / TILE, tile = tiles[first / (TILE * TILE)];
    uint first_x = tile % across * TILE + first % TILE, first_y = tile / across * TILE + first / TILE % TILE;
    p->x = first_x + LANE_INDEX % TILE;
    p->y = first_y + LANE_INDEX / TILE;
    p->inside = (p->x < launch->width) & (p->y < launch->height);
    if (!ANY(p->inside)) return false;
    p->x = p->inside ? p->x : first_x;
    p->y = p->inside ? p->y : first_y;
    p->index = p->y * launch->width + p->x;
    p->code = pixel_code(p->x, p->y);
    return true;
}

static inline real3 camera_direction(const Scene *scene, const Launch *launch, ureal x, ureal y, real2 u) {
    real sx = 2.0f * (TO_REAL(x) + filter_sample(scene, u.x)) / (float)launch->width - 1.0f;
    real sy = 2.0f * (TO_REAL(y) + filter_sample(scene, u.y)) / (float)launch->height - 1.0f;
    real3 right = broadcast(launch->right), up = broadcast(launch->up), forward = broadcast(launch->forward);
    return normalize3(mad3(right, sx, mad3(up, -sy, forward)));
}
