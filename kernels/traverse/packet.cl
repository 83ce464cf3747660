// Packet traversal of coherent rays, for the layout bvh8 with LANES = 8: the rays of all lanes traverse the BVH
// together.
//
// A box or triangle is tested against the eight rays at once. A node takes as much arithmetic as for eight single rays,
// but is loaded, pushed and popped once. Rays must agree in the signs of their directions and in their largest
// component; otherwise they are traced one by one. Hits are identical: the arithmetic is the same, only its order
// differs.
#include "geometry/boxes.cl"
#include "traverse/trace.cl"

typedef struct {
    BoxRays boxes;
    ShearedRay triangles;
    int near_row[3], far_row[3], axis[3];   // the same for all rays: see BoxRay and TriangleRay
    ireal active;
} Packet;

static inline bool agree(ireal numbers, ireal active, int lead) {
    return !ANY((numbers != (ireal)(LANE_INT(numbers, lead))) & active);
}

// Return false if the rays do not agree.
static inline bool make_packet(real3 origin, real3 direction, ireal active, Packet *packet) {
    TriangleRays rays = triangle_rays(origin, direction);
    packet->boxes = box_rays(origin, direction);
    packet->triangles = (ShearedRay){rays.sx, rays.sy, rays.sz, rays.ox, rays.oy, rays.oz};
    packet->active = active;
    int lead = first_bit(mask_bits(active));
    bool all = agree(rays.kz, active, lead);
    for (int k = 0; k < 3; ++k) {
        all = all && agree(packet->boxes.near_row[k], active, lead);
        packet->near_row[k] = LANE_INT(packet->boxes.near_row[k], lead) / 4;
        packet->far_row[k] = LANE_INT(packet->boxes.far_row[k], lead) / 4;
    }
    packet->axis[0] = LANE_INT(rays.kx, lead);
    packet->axis[1] = LANE_INT(rays.ky, lead);
    packet->axis[2] = LANE_INT(rays.kz, lead);
    return all;
}

// Intersect child `child` of a node; return the rays that enter it at 0 <= t <= t_max, and their entry distances.
static inline ireal enter_child(const Packet *packet, global const float *bounds, int child, real t_max, real *entry) {
    real t_near = ZERO, t_far = t_max;
#define CHILD_SLABS(k) { \
        real near_plane = bounds[packet->near_row[k] + child], far_plane = bounds[packet->far_row[k] + child]; \
        real near = fma(near_plane, packet->boxes.near[k], packet->boxes.near_shift[k]); \
        real far = fma(far_plane, packet->boxes.far[k], packet->boxes.far_shift[k]); \
        t_near = near > t_near ? near : t_near; \
        t_far = far < t_far ? far : t_far; \
    }
    CHILD_SLABS(0)
    CHILD_SLABS(1)
    CHILD_SLABS(2)
    *entry = t_near;
    return (t_near <= t_far) & packet->active;
}

#define CORNER(p) {pack->p[packet->axis[0]][i], pack->p[packet->axis[1]][i], pack->p[packet->axis[2]][i]}
#define CORNERS wide p0[3] = CORNER(p0), p1[3] = CORNER(p1), p2[3] = CORNER(p2);

__attribute__((noinline)) static WideHit settle_rays(const Packet *packet, global const Triangles *pack, int i,
                                                     real t_max) {
    CORNERS
    return settle(p0, p1, p2, &packet->triangles, t_max);
}

static inline void hit_pack(const Packet *packet, global const Triangles *pack, Hits *hits) {
    for (int i = 0; i < PACK_SIZE && pack->primitive[i] >= 0; ++i) {
        CORNERS
        ShearedHit sheared = intersect_sheared(p0, p1, p2, &packet->triangles, hits->t);
        WideHit found = sheared.hit;
        if (ANY(sheared.open)) {
            WideHit settled = settle_rays(packet, pack, i, hits->t);
            found.t = settled.t;
            found.hit = settled.hit;
        }
        if (!ANY(found.hit)) continue;
        ireal primitive = pack->primitive[i];
        ireal closer = found.hit & packet->active
                     & ((found.t < hits->t) | ((found.t == hits->t) & (primitive < hits->primitive)));
        hits->t = closer ? found.t : hits->t;
        hits->u = closer ? found.u : hits->u;
        hits->v = closer ? found.v : hits->v;
        hits->primitive = closer ? primitive : hits->primitive;
    }
}

// Push the children that any ray enters, with the one that the first such ray enters first on top.
static inline int push_children(const Packet *packet, global const Node *node, real t_max, int *waiting, real *entries,
                                int top) {
    float least = INFINITY;
    int first = top, nearest = top;
    for (int child = 0; child < 8 && node->child[child] != EMPTY; ++child) {
        real entry;
        ireal entered = enter_child(packet, node->lo[0], child, t_max, &entry);
        if (!ANY(entered)) continue;
        real where = entered ? entry : (real)(INFINITY);
        entries[top] = where;
        waiting[top] = node->child[child];
        float key = LANE(where, first_bit(mask_bits(entered)));
        nearest = key < least ? top : nearest;
        least = key < least ? key : least;
        ++top;
    }
    if (top > first) {
        int child = waiting[top - 1];
        real entry = entries[top - 1];
        waiting[top - 1] = waiting[nearest];
        entries[top - 1] = entries[nearest];
        waiting[nearest] = child;
        entries[nearest] = entry;
    }
    return top;
}

// Trace a packet for the closest or any hits. A ray that is blocked is deactivated if only that counts.
static inline Hits trace_packet(const Scene *scene, Packet *packet, real t_max, const bool stop_at_first) {
    Hits hits = {t_max, ZERO, ZERO, (ireal)(-1), (ireal)(0)};
    int waiting[STACK_SIZE + 1], top = 1;
    real entries[STACK_SIZE + 1];
    waiting[0] = 0;
    entries[0] = ZERO;
    while (top > 0) {
        int reference = waiting[--top];
        if (!ANY((entries[top] <= hits.t) & packet->active)) continue;
        if (reference >= 0) {
            top = push_children(packet, RECORD(scene->nodes, reference), hits.t, waiting, entries, top);
        } else {
            hit_pack(packet, RECORD(scene->packs, ~reference >> 4), &hits);
            if (stop_at_first) packet->active = packet->active & (hits.primitive < 0);
        }
    }
    return hits;
}

// As closest_hit and any_hit, but faster if the rays of the lanes are coherent.
static inline Hits closest_hit_coherent(const Scene *scene, real3 origin, real3 direction, real t_max, ireal active) {
    Packet packet;
    active = active & is_ray(origin, direction);
    if (ANY(active) && make_packet(origin, direction, active, &packet)) return trace_packet(scene, &packet, t_max, false);
    return closest_hit(scene, origin, direction, t_max, active);
}

static inline ireal any_hit_coherent(const Scene *scene, real3 origin, real3 direction, real t_max, ireal active) {
    Packet packet;
    active = active & is_ray(origin, direction);
    if (ANY(active) && make_packet(origin, direction, active, &packet))
        return trace_packet(scene, &packet, t_max, true).primitive >= 0;
    return any_hit(scene, origin, direction, t_max, active);
}
