// A rotation at a constant rate about a fixed axis, as clrt/scene/geometry/motion.py defines it. At the fraction s of the
// way it is that of the quaternion (x, y, z, w) = cos(a)·middle + sin(a)·change, a = (s − ½)·angle being within ±π/4.
//
// Explicit fma leaves nothing to contract: all programs and devices compute the same rotation.

typedef struct { float x[3], y[3], z[3]; } Rotation;   // rows

static inline Rotation turned_by(const float *middle, const float *change, float angle, float s) {
    float a = (s - 0.5f) * angle, a2 = a * a;
    float sine = a * fma(a2, fma(a2, fma(a2, fma(a2, 2.7557319e-6f, -1.9841270e-4f), 8.3333333e-3f), -1.6666667e-1f), 1.0f);
    float cosine = sqrt(fma(-sine, sine, 1.0f));
    float q[4];
    for (int k = 0; k < 4; ++k) q[k] = fma(cosine, middle[k], sine * change[k]);
    float x2 = 2.0f * q[0], y2 = 2.0f * q[1], z2 = 2.0f * q[2];
    return (Rotation){{1.0f - fma(y2, q[1], z2 * q[2]), fma(x2, q[1], -(z2 * q[3])), fma(x2, q[2], y2 * q[3])},
                      {fma(x2, q[1], z2 * q[3]), 1.0f - fma(x2, q[0], z2 * q[2]), fma(y2, q[2], -(x2 * q[3]))},
                      {fma(x2, q[2], -(y2 * q[3])), fma(y2, q[2], x2 * q[3]), 1.0f - fma(x2, q[0], y2 * q[1])}};
}

static inline float along(const float *row, const float *v) { return fma(row[0], v[0], fma(row[1], v[1], row[2] * v[2])); }
