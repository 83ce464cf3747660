// Motion of instances (clrt/scene/geometry/motion.py): at the fraction s of the exposure a point p of the mesh is at
// offset + s·moved + R(s)·outer·((1 + s·growth) ∘ (inner·p)). World frame.
//
// Its inverse is that of each factor, whose inverses the host computed, so what it loses is a few roundings of each.
#include "geometry/turn.cl"

static inline Rotation rotation_at(global const Motion *motion, float s) {
    float middle[4], change[4];
    for (int k = 0; k < 4; ++k) {
        middle[k] = motion->middle[k];
        change[k] = motion->change[k];
    }
    return turned_by(middle, change, motion->angle, s);
}

static inline float along_row(global const float *row, const float *v) {
    return fma(row[0], v[0], fma(row[1], v[1], row[2] * v[2]));
}

// Transform a point of the world, or a direction if `point` is 0, to the mesh's frame.
static inline void moved_back(global const Motion *motion, const Rotation *r, float s, float point, const float *world,
                              float *own) {
    float v[3], w[3];
    for (int k = 0; k < 3; ++k) v[k] = fma(-point, fma(s, motion->moved[k], motion->offset[k]), world[k]);
    for (int k = 0; k < 3; ++k) w[k] = fma(r->x[k], v[0], fma(r->y[k], v[1], r->z[k] * v[2]));
    for (int k = 0; k < 3; ++k)
        v[k] = fma(-point, motion->inner[k][3], along_row(motion->from_outer[k], w) / fma(s, motion->growth[k], 1.0f));
    for (int k = 0; k < 3; ++k) own[k] = along_row(motion->from_inner[k], v);
}

// Compute the matrix to the world, rows[3][4], at the fraction s.
static inline void pose_at(global const Motion *motion, float s, float rows[3][4]) {
    Rotation r = rotation_at(motion, s);
    for (int column = 0; column < 4; ++column) {
        float v[3], w[3];
        for (int k = 0; k < 3; ++k) v[k] = fma(s, motion->growth[k], 1.0f) * motion->inner[k][column];
        for (int k = 0; k < 3; ++k) w[k] = along_row(motion->outer[k], v);
        rows[0][column] = along(r.x, w);
        rows[1][column] = along(r.y, w);
        rows[2][column] = along(r.z, w);
    }
    for (int k = 0; k < 3; ++k) rows[k][3] += fma(s, motion->moved[k], motion->offset[k]);
}
