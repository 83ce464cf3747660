// The primitives of a BVH: triangles and spheres in one order, their boxes and areas, in scene units.
//
// Coordinates are finite and below 1e18, so that no area overflows. Every kernel of the builder processes a block of
// consecutive items per work-item: a long one on a CPU, a short one on a GPU.

typedef struct { float3 lo, hi; } Box;

#define NO_BOX ((Box){(float3)(INFINITY), (float3)(-INFINITY)})

// Primitive p is nine floats at shapes[9 p]: a triangle's corners, or a sphere's centre and radius. ids[p] is its index
// in the scene, where triangles come first.
typedef struct {
    global const float *shapes;
    global const uint *ids;
    uint triangle_count;
} Primitives;

#define SHAPE 9
#define PRIMITIVE_PARAMETERS global const float *shapes, global const uint *ids, uint triangle_count
#define PRIMITIVE_ARGUMENTS {shapes, ids, triangle_count}

static inline bool is_sphere(const Primitives *primitives, int primitive) {
    return (!TRIANGLES || primitives->ids[primitive] >= primitives->triangle_count) && SPHERES;
}

// Write x, y and z of v to a column of three rows.
#define WRITE_COLUMN(rows, column, v) { \
        (rows)[0][column] = (v).x; \
        (rows)[1][column] = (v).y; \
        (rows)[2][column] = (v).z; \
    }

static inline Box box_union(Box a, Box b) {
    return (Box){a.lo < b.lo ? a.lo : b.lo, a.hi > b.hi ? a.hi : b.hi};
}

#define TRIANGLE_PAD 4.7683716e-7f   // 2^-21; for the reason see clrt/accel/layouts.py

static inline Box triangle_box(float3 a, float3 b, float3 c) {
    Box box = box_union(box_union((Box){a, a}, (Box){b, b}), (Box){c, c});
    float3 size = box.hi - box.lo;
    float side = size.x > size.y ? size.x : size.y;
    float3 longest = side > size.z ? side : size.z;
    return (Box){fma(longest, (float3)(-TRIANGLE_PAD), box.lo), fma(longest, (float3)(TRIANGLE_PAD), box.hi)};
}

static inline Box shape_box(global const float *shape, bool sphere) {
#if SPHERES
    if (sphere) {
        float3 centre = vload3(0, shape);
        return (Box){nextafter(centre - shape[3], (float3)(-INFINITY)), nextafter(centre + shape[3], (float3)(INFINITY))};
    }
#endif
    return triangle_box(vload3(0, shape), vload3(1, shape), vload3(2, shape));
}

static inline Box primitive_box(const Primitives *primitives, int primitive) {
    return shape_box(primitives->shapes + SHAPE * primitive, is_sphere(primitives, primitive));
}

// One explicit fma leaves nothing to contract: all devices compute the same area, hence the same BVH.
static inline float half_area(Box box) {
    float3 size = box.hi - box.lo;
    return fma(size.x, size.y + size.z, size.y * size.z);
}
