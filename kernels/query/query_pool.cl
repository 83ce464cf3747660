// The kernels of query/query.cl for processors that benefit from many rays in flight: a work-item answers SHARE rays.
#include "query/query_rays.cl"
#include "traverse/pool.cl"

#if STOP_AT_FIRST
typedef uchar Answer;
#else
typedef RayHit Answer;
#endif

// The next rays to start: LANES of the work-item's share, prepared together.
typedef struct {
    Rays rays;
    FlightRays flights;
    uint next, lane;   // index of the next ray in the host's arrays, and its lane
} Departures;

static inline Answer answer(const Hit *hit, float to_t) {
#if STOP_AT_FIRST
    return hit->primitive >= 0;
#else
    return ray_hit(hit->t, hit->u, hit->v, hit->primitive, INSTANCE_OF(hit), to_t);
#endif
}

__attribute__((noinline)) static void load_departures(Departures *d, QUERY_RAYS, float unit, uint end) {
    d->rays = load_rays(origins, directions, t_max, unit, d->next, end);
    d->flights = flight_rays(d->rays.origin, d->rays.direction);
    d->lane = 0;
}

// Start the next ray in the slot `f`; return false if none is left. Rays that cannot hit anything are answered
// immediately.
__attribute__((always_inline)) static inline bool depart(Departures *d, QUERY_RAYS, float unit, uint end, global Answer *answers, Flight *f) {
    while (d->next < end) {
        if (d->lane == LANES) load_departures(d, origins, directions, t_max, unit, end);
        uint lane = d->lane++, index = d->next++;
        if (LANE_INT(d->rays.valid, lane)) {
            Ray ray = one_ray(&d->rays.origin, &d->rays.direction, &d->rays.t_max, lane);
            take_off(f, &d->flights, &ray, lane, index, LANE(d->rays.to_t, lane));
            return true;
        }
        Hit miss = {0.0f, 0.0f, 0.0f, -1};
        answers[index] = answer(&miss, 1.0f);
    }
    return false;
}

// The rays that are at nodes and those that are at leaves; entries after the last one of a list are ignored.
typedef struct { Flight *at_nodes[POOL + 1], *at_leaves[POOL + 1]; } Round;

// Write a ray to both lists and advance the length of one, without a branch.
#define LIST(f) { \
        int leaf = f->reference < 0; \
        then->at_nodes[inner] = then->at_leaves[leaves] = f; \
        inner += 1 - leaf; \
        leaves += leaf; \
    }

// Set where a ray continues and prefetch the node or leaf. A ray that is done is answered, and the next one starts.
#define GO_ON(to) { \
        f->reference = to; \
        if (f->reference == DONE) { \
            answers[f->index] = answer(&f->hit, f->to_t); \
            if (!depart(&departures, origins, directions, t_max, unit, end, answers, f)) continue; \
        } \
        fetch(&scene, f->reference); \
        LIST(f) \
    }

__attribute__((vec_type_hint(real)))
kernel void query_pool(SCENE_PARAMETERS, QUERY_RAYS, global Answer *answers, float unit, uint count) {
    Scene scene = SCENE_ARGUMENTS;
    Flight flights[POOL];
    Round rounds[2], *now = rounds, *then = rounds + 1;
    int inner = 0, leaves = 0;   // lengths of the lists in `then`
    Departures departures;
    departures.next = (uint)get_global_id(0) * SHARE;
    departures.lane = LANES;
    uint end = departures.next + SHARE < count ? departures.next + SHARE : count;
    for (int place = 0; place < POOL; ++place) {
        Flight *f = flights + place;
        if (!depart(&departures, origins, directions, t_max, unit, end, answers, f)) break;
        LIST(f)
    }
    while (inner + leaves > 0) {
        Round *done = now;
        now = then;
        then = done;
        int inner_now = inner, leaves_now = leaves;
        inner = leaves = 0;
        for (int i = 0; i < inner_now; ++i) {
            Flight *f = now->at_nodes[i];
            GO_ON(visit_node(&scene, f, STOP_AT_FIRST))
        }
        for (int i = 0; i < leaves_now; ++i) {
            Flight *f = now->at_leaves[i];
            GO_ON(visit_leaf(&scene, f, STOP_AT_FIRST))
        }
    }
}
