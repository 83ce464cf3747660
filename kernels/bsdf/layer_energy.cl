// The energy that min(T(wo), T(wi)) removes from gloss and fibres (layers.cl), from the table of
// clrt/scene/materials/layer_energy.py: for each roughness of the base, the coat and the fibres, three entries of
// means and LAYER_STEPS + 1 entries by angle, uniform in √cos.
#define LAYER_STEPS 96
#define LAYER_PARTS 8
#define LAYER_ENTRIES (LAYER_STEPS + 4)
// Indices of entries; layer_place returns that of an angle.
#define LAYER_MEAN ZERO
#define LAYER_PRODUCTS ONE

typedef struct { real part[LAYER_PARTS]; } LayerEntry;

// Interpolate linearly between entry `number` and the next.
static inline float8 entry_between(const Scene *scene, int number, float across) {
    global const float *entry = RECORD(scene->layer_entries, number)->part;
    return mix(vload8(0, entry), vload8(1, entry), across);
}

#if LAYER_ROWS
// Interpolate linearly between the nearest roughnesses on each of the three axes. steps: intervals per axis, 0 if it
// has one row.
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
        int step = clamp((int)LANE(place, lane), 0, LAYER_ENTRIES - 2);    // the value in an inactive lane is arbitrary
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
