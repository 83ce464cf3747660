// What min(T(wo), T(wi)) takes from gloss and fibres (layers.cl) by the table of clrt/scene/layer_energy.py: for each roughness of
// the base, the film and the fibres three entries of means, and those of LAYER_STEPS + 1 angles, even in √cos.
#define LAYER_STEPS 96
#define LAYER_PARTS 8
#define LAYER_ENTRIES (LAYER_STEPS + 4)
// Places of entries; of an angle's see layer_place.
#define LAYER_MEAN ZERO
#define LAYER_PRODUCTS ONE

typedef struct { real part[LAYER_PARTS]; } LayerEntry;

// Linear between an entry and the next one, by the number of the former.
static inline float8 entry_between(const Scene *scene, int number, float across) {
    global const float *entry = RECORD(scene->layer_entries, number)->part;
    return mix(vload8(0, entry), vload8(1, entry), across);
}

#if LAYER_ROWS
// Linear between the roughnesses next to the place on each of the three axes, which have as many steps: 0 where all agree.
static inline float8 entry_in_rows(const Scene *scene, int number, const float *place, const float *steps, float across) {
    float8 sum = 0.0f;
    for (int corner = 0; corner < 8; ++corner) {
        float weight = 1.0f;
        int row = 0;
        for (int axis = 0; axis < 3; ++axis) {
            int first = clamp((int)place[axis], 0, max((int)steps[axis] - 1, 0)), beyond = corner >> axis & 1;
            weight *= beyond ? place[axis] - first : 1.0f - (place[axis] - first);
            row = row * ((int)steps[axis] + 1) + first + beyond;
        }
        if (weight > 0.0f) sum += weight * entry_between(scene, number + row * LAYER_ENTRIES, across);
    }
    return sum;
}
#endif

static inline real layer_place(real cos_theta) {
    return 3.0f + (float)LAYER_STEPS * sqrt(minimum(maximum(cos_theta, ZERO), ONE));
}

static inline LayerEntry entry_at(const struct metallic_roughness *m, real place) {
    RealLanes parts[LAYER_PARTS];
    for (int lane = 0; lane < LANES; ++lane) {
        int step = clamp((int)LANE(place, lane), 0, LAYER_ENTRIES - 2);    // that of an idle lane may be anything
        int number = LANE_INT(m->first_entry, lane) + step;
        float across = LANE(place, lane) - step;
#if LAYER_ROWS
        float at[3] = {LANE(m->row.x, lane), LANE(m->row.y, lane), LANE(m->row.z, lane)};
        float steps[3] = {LANE(m->last_row.x, lane), LANE(m->last_row.y, lane), LANE(m->last_row.z, lane)};
        float8 entry = entry_in_rows(m->scene, number, at, steps, across);
#else
        float8 entry = entry_between(m->scene, number, across);
#endif
        for (int part = 0; part < LAYER_PARTS; ++part) parts[part].lane[lane] = ((const float *)&entry)[part];
    }
    LayerEntry entry;
    for (int part = 0; part < LAYER_PARTS; ++part) entry.part[part] = parts[part].all;
    return entry;
}
