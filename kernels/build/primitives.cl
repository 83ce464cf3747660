// What a tree is built over: boxes of triangles (primitives 0 … m − 1) and of spheres (m …), lengths of the scene.
//
// Coordinates are finite and below 1e18, so that no area overflows. Every kernel of the builder works on a block of
// consecutive items in each work-item: a long one on a CPU, a short one on a GPU.

typedef struct { float lo[3], hi[3]; } Box;

typedef struct {
    global const float *triangles;   // nine floats each: p0, p1, p2
    global const float *spheres;     // four floats each: centre and radius
    uint triangle_count;
} Primitives;

#define PRIMITIVE_PARAMETERS global const float *triangles, global const float *spheres, uint triangle_count
#define PRIMITIVE_ARGUMENTS {triangles, spheres, triangle_count}

static inline bool is_sphere(const Primitives *primitives, uint primitive) {
    return SPHERES && primitive >= primitives->triangle_count;
}

static inline Box primitive_box(const Primitives *primitives, uint primitive) {
    Box box;
    if (is_sphere(primitives, primitive)) {
        global const float *s = primitives->spheres + 4 * (primitive - primitives->triangle_count);
        for (int k = 0; k < 3; ++k) {
            box.lo[k] = nextafter(s[k] - s[3], -INFINITY);
            box.hi[k] = nextafter(s[k] + s[3], INFINITY);
        }
        return box;
    }
    global const float *p = primitives->triangles + 9 * primitive;
    for (int k = 0; k < 3; ++k) {
        float a = p[k], b = p[k + 3], c = p[k + 6];
        float low = a < b ? a : b, high = a < b ? b : a;
        box.lo[k] = c < low ? c : low;
        box.hi[k] = c > high ? c : high;
    }
    return box;
}

static inline Box box_union(Box a, Box b) {
    Box box;
    for (int k = 0; k < 3; ++k) {
        box.lo[k] = a.lo[k] < b.lo[k] ? a.lo[k] : b.lo[k];
        box.hi[k] = a.hi[k] > b.hi[k] ? a.hi[k] : b.hi[k];
    }
    return box;
}

// With one explicit fma there is nothing left to contract: all devices get the same number, hence the same tree.
static inline float half_area(Box box) {
    float x = box.hi[0] - box.lo[0], y = box.hi[1] - box.lo[1], z = box.hi[2] - box.lo[2];
    return fma(x, y + z, y * z);
}
