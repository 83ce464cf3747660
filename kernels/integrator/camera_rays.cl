// The pixels of a work-item and the camera rays through them. World frame.
//
// The camera's file in camera/ provides, for the image position (sx, sy), from (−1, −1) at the upper left corner to
// (1, 1) at the lower right, slightly beyond with a wide filter:
//
//   ray_through(launch, sx, sy, &sampler, &ray)   the camera ray; cameras without random numbers leave `sampler` alone.
//                                                 Returns the lanes that have one: the samples of the others are black,
//                                                 and their rays, which nothing follows, are finite
//
// or, if it defines LISTED_RAYS,
//
//   listed_ray(scene, launch, x, y, &ray)         the camera ray of pixel (x, y), likewise
//
// Each file documents the meaning of launch->right, up and forward; clrt/scene/cameras.py computes them.
#include "sampler/interface.cl"
#include "core/vector.cl"
#include SHUTTER_FILE
#include FILTER

typedef struct {
    real3 origin, direction;   // direction: unit
#if ON_SURFACES
    real3 surface_normal;
    real reach;                // 0: without limit
#endif
} CameraRay;

#include CAMERA
#include CAMERA_MOTION_FILE

// The coverage of a sample, an argument of what computes its light if the film stores it.
#if ALPHA
#define ALPHA_PARAMETER , real *alpha
#define ALPHA_ARGUMENT(alpha) , alpha
#else
#define ALPHA_PARAMETER
#define ALPHA_ARGUMENT(alpha)
#endif

// The light of a sample by light group, likewise.
#if EMITTER_GROUPS
#define GROUPS_PARAMETER , real3 *groups
#define GROUPS_ARGUMENT(groups) , groups
#else
#define GROUPS_PARAMETER
#define GROUPS_ARGUMENT(groups)
#endif

// Set the time of lanes, if the camera or objects move (integrator/shutter.cl): of samples, of the middle of the
// exposure, and of samples for stages in which only objects move.
#if TIME
#define SET_TIME(scene, launch, sampler, y) { \
        const Sampler timed = sampler; \
        (scene).time = sample_time(&(launch), &timed, y); \
    }
#define SET_MIDDLE_TIME(scene, launch, y) (scene).time = time_of(&(launch), y, (real)(0.5f));
#else
#define SET_TIME(scene, launch, sampler, y)
#define SET_MIDDLE_TIME(scene, launch, y)
#endif
#if MOTION
#define SET_OBJECTS_TIME(scene, launch, sampler, y) SET_TIME(scene, launch, sampler, y)
#else
#define SET_OBJECTS_TIME(scene, launch, sampler, y)
#endif

// Whether a catcher was seen, and the scene of a launch (surface/catcher.cl).
#if CATCHER
#define CATCHER_PARAMETER , ireal *caught
#define CATCHER_ARGUMENT(caught) , caught
#define CHOOSE_WORLD(scene, launch) (scene).bare = (launch).bare;
#else
#define CATCHER_PARAMETER
#define CATCHER_ARGUMENT(caught)
#define CHOOSE_WORLD(scene, launch)
#endif

// The pixels of a work-item's lanes: LANES pixels of a tile of TILE x TILE. A launch covers pixels from first_pixel
// on, in the order of `tiles`, row by row within each tile. A lane outside the image gets the pixel of the first lane
// and is not `inside`.
typedef struct {
    ureal index, x, y, code;   // index: in the film, which covers the image or, if FILM_WINDOWS, the launch
    ireal inside;
} LanePixels;

// Compute the pixels of group `group` of the launch; return false if the group is past its end.
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

// Return the image position (sx, sy) of a sample in pixel (x, y): u samples the filter around the pixel centre, u =
// (½, ½).
static inline real2 place_in_pixel(const Scene *scene, const Launch *launch, ureal x, ureal y, real2 u) {
    return (real2){2.0f * (TO_REAL(x) + filter_sample(scene, u.x)) / (float)launch->width - 1.0f,
                   2.0f * (TO_REAL(y) + filter_sample(scene, u.y)) / (float)launch->height - 1.0f};
}

// The direction of view, unit.
static inline real3 viewing_direction(const Scene *scene, const Launch *launch) {
    real3 right = broadcast(launch->right), up = broadcast(launch->up);
#if CAMERA_MOTION
    for (int lane = 0; lane < LANES; ++lane) {
        Launch now = camera_at(launch, LANE(scene->time, lane));
        ireal own = AS_INT(LANE_INDEX) == lane;
        right = choose(own, broadcast(now.right), right);
        up = choose(own, broadcast(now.up), up);
    }
#endif
    return normalize3(cross3(up, right));
}

// Generate a camera ray through pixel (x, y), filter-sampled by u. Returns the lanes that have one.
static inline ireal camera_ray(const Scene *scene, const Launch *launch, ureal x, ureal y, real2 u, Sampler *sampler,
                               CameraRay *ray) {
#if LISTED_RAYS
    return listed_ray(scene, launch, x, y, ray);
#else
    real2 place = place_in_pixel(scene, launch, x, y, u);
#if CAMERA_MOTION
    return ray_through_moving(scene, launch, place.x, place.y, sampler, ray);
#else
    return ray_through(launch, place.x, place.y, sampler, ray);
#endif
#endif
}
