// New corners and boxes for a tree whose vertices have moved; what is below what stays. From the leaves up: a launch a
// level, the deepest first, of which each item is a node.
//
// vertices: three floats each, lengths of the tree. faces: three indices each, those that the tree was built over.
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
