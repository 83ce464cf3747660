// What a work-item sees: its pixels, and the camera's rays through them. World frame.
//
// The camera's file in camera/ provides, for the place (sx, sy) of the picture, which goes from (−1, −1), its upper left
// corner, to (1, 1), the lower right, and with a wide filter a little beyond:
//
//   ray_through(launch, sx, sy, &sampler)     its ray; a camera that draws no numbers leaves them to the path
//
// Each says what launch->right, up and forward are to it; clrt/rendering/camera.py makes them.
#include "sampler.cl"
#include "vector.cl"
#include FILTER

typedef struct { real3 origin, direction; } CameraRay;   // direction: unit

#include CAMERA

// What the lanes of a work-item see: LANES pixels of a tile of TILE x TILE. A launch takes those from first_pixel on,
// counted tile by tile as `tiles` lists them, row by row in each. A lane past the picture's edge is given its first lane's
// pixel and is not `inside`.
typedef struct {
    ureal index, x, y, code;   // index: of the pixel in the film, which is the picture or, of FILM_WINDOWS, the launch's
    ireal inside;
} LanePixels;

// The LANES pixels of number `group` in the launch; false where there are none.
static inline bool group_pixels(const Launch *launch, global const uint *tiles, uint group, LanePixels *p) {
    uint first = group * LANES;
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
#if FILM_WINDOWS
    p->index = first - launch->first_pixel + (p->inside ? LANE_INDEX : (ureal)(0));
#else
    p->index = p->y * launch->width + p->x;
#endif
    p->code = pixel_code(p->x, p->y);
    return true;
}

static inline bool lane_pixels(const Launch *launch, global const uint *tiles, LanePixels *p) {
    return group_pixels(launch, tiles, (uint)get_global_id(0), p);
}

// A place (sx, sy) of the pixel (x, y): u draws it from the filter around the pixel's middle, which is that of (½, ½).
static inline real2 place_in_pixel(const Scene *scene, const Launch *launch, ureal x, ureal y, real2 u) {
    return (real2){2.0f * (TO_REAL(x) + filter_sample(scene, u.x)) / (float)launch->width - 1.0f,
                   2.0f * (TO_REAL(y) + filter_sample(scene, u.y)) / (float)launch->height - 1.0f};
}

// A ray through such a place.
static inline CameraRay camera_ray(const Scene *scene, const Launch *launch, ureal x, ureal y, real2 u, Sampler *sampler) {
    real2 place = place_in_pixel(scene, launch, x, y, u);
    return ray_through(launch, place.x, place.y, sampler);
}
