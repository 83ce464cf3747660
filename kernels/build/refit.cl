// Refit a BVH after its vertices have moved: new corners and boxes, same topology. From the leaves up: a launch per
// level, the deepest first, with a node per item.
//
// vertices: three floats each, in the BVH's units. faces: three indices each, those that the BVH was built over.
#include "build/primitives.cl"

#define REFIT_PARAMETERS uint first_node, global const float *vertices, global const int *faces, global Node *nodes, \
                         global Triangles *leaves

typedef struct { float3 p0, p1, p2; } Corners;

static inline Corners face_corners(global const float *vertices, global const int *faces, int primitive) {
    int3 face = vload3(primitive, faces);
    return (Corners){vload3(face.x, vertices), vload3(face.y, vertices), vload3(face.z, vertices)};
}

static inline Box corners_box(Corners c) {
    return triangle_box(c.p0, c.p1, c.p2);
}
