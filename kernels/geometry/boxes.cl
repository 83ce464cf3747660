// Ray against eight boxes at once by slabs, one multiply-add per plane.
//
// A plane's t is plane·inverse + shift, inverse = 1/direction and shift = −origin·inverse. Near planes are pulled in
// and far planes pushed out by BOX_PAD of t, folded into inverse and shift, and by BOX_PAD of |shift|. A direction
// component below 1/STEEPEST is replaced by that value, and SIDE pads its planes. Overflow gives NaN, which the
// comparisons drop: such a ray counts as inside the slab. Flat boxes are hit since near == far counts as a hit.
// Directions have a length near 1.
#include "core/vector.cl"
#include BOX_TEST

typedef struct {
    float near[3], far[3], near_shift[3], far_shift[3];
    int near_row[3], far_row[3];   // offsets in bytes in a node's bounds (lo x, y, z, hi x, y, z, eight floats each)
} BoxRay;

typedef struct { real near[3], far[3], near_shift[3], far_shift[3]; ireal near_row[3], far_row[3]; } BoxRays;

static inline BoxRays box_rays(real3 origin, real3 direction) {
    BoxRays r;
#define INVERT_PADDED(axis, o, d) { \
        real inverse = 1.0f / d; \
        ireal steep = !(absolute(inverse) < STEEPEST); \
        inverse = steep ? copysign((real)(STEEPEST), inverse) : inverse; \
        r.near[axis] = inverse * (1.0f - BOX_PAD); \
        r.far[axis] = inverse * (1.0f + BOX_PAD); \
        real near_shift = -o * r.near[axis], far_shift = -o * r.far[axis]; \
        real side = steep ? (real)(SIDE) : ZERO; \
        r.near_shift[axis] = near_shift - (absolute(near_shift) * BOX_PAD + side); \
        r.far_shift[axis] = far_shift + (absolute(far_shift) * BOX_PAD + side); \
        r.near_row[axis] = inverse < 0.0f ? (ireal)(32 * axis + 96) : (ireal)(32 * axis); \
        r.far_row[axis] = 64 * axis + 96 - r.near_row[axis]; \
    }
    INVERT_PADDED(0, origin.x, direction.x)
    INVERT_PADDED(1, origin.y, direction.y)
    INVERT_PADDED(2, origin.z, direction.z)
    return r;
}

static inline BoxRay box_ray(const BoxRays *rays, int lane) {
#define OF_LANE(member) {LANE(rays->member[0], lane), LANE(rays->member[1], lane), LANE(rays->member[2], lane)}
#define INT_OF_LANE(member) {LANE_INT(rays->member[0], lane), LANE_INT(rays->member[1], lane), \
                             LANE_INT(rays->member[2], lane)}
    return (BoxRay){OF_LANE(near), OF_LANE(far), OF_LANE(near_shift), OF_LANE(far_shift), INT_OF_LANE(near_row),
                    INT_OF_LANE(far_row)};
}

// The boxes that are entered at 0 <= t <= t_max, and their entry distances. bounds: six rows as above.
static inline int8 enter_eight(const BoxRay *ray, global const float *bounds, float t_max, float8 *entry) {
    global const char *rows = (global const char *)bounds;
    float8 t_near = 0.0f, t_far = t_max;
#define EIGHT_SLABS(axis) { \
        float8 near_plane = vload8(0, (global const float *)(rows + ray->near_row[axis])); \
        float8 far_plane = vload8(0, (global const float *)(rows + ray->far_row[axis])); \
        float8 near = fma(near_plane, (float8)(ray->near[axis]), (float8)(ray->near_shift[axis])); \
        float8 far = fma(far_plane, (float8)(ray->far[axis]), (float8)(ray->far_shift[axis])); \
        t_near = near > t_near ? near : t_near; \
        t_far = far < t_far ? far : t_far; \
    }
    EIGHT_SLABS(0)
    EIGHT_SLABS(1)
    EIGHT_SLABS(2)
    *entry = t_near;
    return t_near <= t_far;
}
