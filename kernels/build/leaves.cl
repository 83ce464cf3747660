// The records of leaves: packs of eight triangles, single triangles, spheres.
#include "build/open.cl"
#include "build/tiles.cl"

#if SPHERES
static inline void write_spheres(const Primitives *primitives, const int *members, int count, global LeafSphere *leaf) {
    for (int i = 0; i < count; ++i) {
        global const float *s = primitives->shapes + SHAPE * members[i];
        leaf[i] = (LeafSphere){{s[0], s[1], s[2]}, s[3], (int)primitives->ids[members[i]], {0, 0, 0}};
    }
}
#endif

#if TRIANGLES && LANES == 8
// Unused lanes get NaN corners, which no ray hits, and primitive −1.
static inline void write_triangles(const Primitives *primitives, const int *members, int count, global Triangles *pack) {
    for (int lane = 0; lane < LANES; ++lane) {
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

// The SAH cost of a slot: its area, for a leaf once per intersection test.
static inline float visited_area(Box box, Content content) {
    return half_area(box) * (content.leaf ? tests_of(content.sphere, content.count) : 1.0f);
}

// The indices of the next wide node of the level below, and of the next records of triangles and spheres. Levels start
// at first_node and next_node, the records of this one at first_triangle and first_sphere. visited: by node.
typedef struct { uint node, triangle, sphere; } Places;

#define LEVEL_PARAMETERS PRIMITIVE_PARAMETERS, global const BinaryNode *binary, global const uint *plans, \
                         global const int *slots, global const uint *places, uint first_node, uint next_node, \
                         uint first_triangle, uint first_sphere, global Node *nodes, global Triangles *triangles, \
                         global LeafSphere *leaf_spheres, global float *visited
#define PLACES(i) {next_node + places[i], first_triangle + places[count + (i)], first_sphere + places[2 * count + (i)]}

// The nodes i of a level in this work-item's block.
#define FOR_NODES \
    Primitives primitives = PRIMITIVE_ARGUMENTS; \
    uint first = (uint)get_global_id(0) * block, end = first + block < count ? first + block : count; \
    for (uint i = first; i < end; ++i)

// The contents of the slots of node i, and the indices of what they refer to.
#define OPEN_NODE \
        Places next = PLACES(i); \
        prefetch_slots(binary, plans, slots, i, end); \
        Content contents[CHILDREN]; \
        contents_of(&primitives, plans, slots + CHILDREN * i, contents);

// Allocate the index of a slot's content; write the records of a leaf.
static inline uint fill_slot(const Primitives *primitives, global const BinaryNode *nodes, Content content, Places *next,
                             global Triangles *triangles, global LeafSphere *leaf_spheres) {
    if (!content.leaf) return next->node++;
    int members[LEAF_SIZE];
    int count = leaf_primitives(nodes, content.node, members);
    uint first = content.sphere ? next->sphere : next->triangle;
#if SPHERES
    if (content.sphere) write_spheres(primitives, members, count, leaf_spheres + first);
#endif
#if TRIANGLES
    if (!content.sphere) write_triangles(primitives, members, count, triangles + first);
#endif
    *(content.sphere ? &next->sphere : &next->triangle) += content.units;
    return first;
}

// In each tile, the sum of the areas of nodes.
kernel void sum_areas(uint count, uint block, global const float *visited, global float *sums) {
    local float part[TILE_ITEMS];
    TILE_RANGE
    float sum = 0.0f;
    for (uint i = first + me; i < end; i += items) sum += visited[i];
    part[me] = sum;
    barrier(CLK_LOCAL_MEM_FENCE);
    if (me > 0) return;
    for (uint k = 1; k < items; ++k) sum += part[k];
    sums[tile] = sum;
}
