// The records of leaves: packs of eight triangles, single triangles, spheres.
#include "build/open.cl"

#if SPHERES
static inline void write_spheres(const Primitives *primitives, const int *members, int count, global LeafSphere *leaf) {
    for (int i = 0; i < count; ++i) {
        global const float *s = primitives->shapes + SHAPE * members[i];
        leaf[i] = (LeafSphere){{s[0], s[1], s[2]}, s[3], (int)primitives->ids[members[i]], {0, 0, 0}};
    }
}
#endif

#if TRIANGLES && PACK == 8
// Unused lanes get corners of NaN, which no ray hits, and primitive −1.
static inline void write_triangles(const Primitives *primitives, const int *members, int count, global Triangles *pack) {
    for (int lane = 0; lane < PACK; ++lane) {
        bool used = lane < count;
        int member = members[used ? lane : 0];
        global const float *p = primitives->shapes + SHAPE * member;
        for (int k = 0; k < 3; ++k) {
            pack->p0[k][lane] = used ? p[k] : NAN;
            pack->p1[k][lane] = used ? p[k + 3] : NAN;
            pack->p2[k][lane] = used ? p[k + 6] : NAN;
        }
        pack->primitive[lane] = used ? (int)primitives->ids[member] : -1;
    }
}
#elif TRIANGLES
static inline void write_triangles(const Primitives *primitives, const int *members, int count, global Triangles *leaf) {
    for (int i = 0; i < count; ++i) {
        global const float *p = primitives->shapes + SHAPE * members[i];
        leaf[i] = (Triangles){{p[0], p[1], p[2]}, (int)primitives->ids[members[i]], {p[3], p[4], p[5]}, 0,
                              {p[6], p[7], p[8]}, 0};
    }
}
#endif

// Writes the leaf under binary node `node` from record `first` of its kind on.
static inline void write_leaf(const Primitives *primitives, global const BinaryNode *nodes, int node, Content content,
                              uint first, global Triangles *packs, global LeafSphere *leaf_spheres) {
    int members[LEAF_SIZE];
    int count = leaf_primitives(nodes, node, members);
#if SPHERES
    if (content.sphere) write_spheres(primitives, members, count, leaf_spheres + first);
#endif
#if TRIANGLES
    if (!content.sphere) write_triangles(primitives, members, count, packs + first);
#endif
}
