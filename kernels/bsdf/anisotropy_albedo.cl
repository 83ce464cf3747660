// Albedos of a single bounce at an anisotropic surface, which depend on the azimuth: the two quantities of ggx_albedo.cl
// from the table of clrt/scene/materials/anisotropy_energy.py, an entry of hemispherical means and one for each cell of
// cosine and azimuth, or for textures a row of such entries for each pair of alpha_t and alpha_b.
#define ANISOTROPY_STEPS 32
#define ANISOTROPY_AZIMUTHS 12
#define ANISOTROPY_ROWS 10
#define ANISOTROPY_ENTRIES (1 + ANISOTROPY_STEPS * ANISOTROPY_AZIMUTHS)

// Interpolate linearly between the nearest rows in an entry of each.
static inline float8 anisotropy_entry(const Scene *scene, int first, float row_t, float row_b) {
    float8 sum = 0.0f;
    int t = clamp((int)row_t, 0, ANISOTROPY_ROWS - 2), b = clamp((int)row_b, 0, ANISOTROPY_ROWS - 2);
    for (int corner = 0; corner < 4; ++corner) {
        int beyond_t = corner >> 1, beyond_b = corner & 1;
        float weight = (beyond_t ? row_t - t : 1.0f - (row_t - t)) * (beyond_b ? row_b - b : 1.0f - (row_b - b));
        int row = (t + beyond_t) * ANISOTROPY_ROWS + b + beyond_b;
        if (weight > 0.0f) sum += weight * vload8(0, RECORD(scene->layer_entries, first + row * ANISOTROPY_ENTRIES)->part);
    }
    return sum;
}

// The fractions of a single bounce at w on anisotropic surfaces.
static inline Bounce anisotropic_bounce(const Anisotropy *a, real3 w) {
    real size2 = w.x * w.x + w.y * w.y;
    real3 s = stretched_by(a, w);
    real alpha2 = a->alpha_t * a->alpha_b, masking2 = size2 > 0.0f ? alpha2 * (s.x * s.x + s.y * s.y) / size2 : alpha2;
    real width = 2.0f * sqrt(sqrt(masking2)), cosine = maximum(w.z, ZERO), inverse = 1.0f / a->alpha_b;
    real u = ANISOTROPY_AZIMUTHS * log(masking2 * inverse * inverse) / (2.0f * log(a->alpha_t * inverse));
    real t = ANISOTROPY_STEPS * sqrt(cosine / (cosine + width) * (1.0f + width));
    u = minimum(maximum(u, ZERO), (real)(ANISOTROPY_AZIMUTHS * BELOW_ONE));
    t = minimum(t, (real)(ANISOTROPY_STEPS * BELOW_ONE));
    RealLanes lost, bend;
    for (int lane = 0; lane < LANES; ++lane) {
        // Values in inactive and isotropic lanes are arbitrary.
        int step = clamp((int)LANE(t, lane), 0, ANISOTROPY_STEPS - 1), azimuth = clamp((int)LANE(u, lane), 0, ANISOTROPY_AZIMUTHS - 1);
        int number = LANE_INT(a->first, lane) + 1 + step * ANISOTROPY_AZIMUTHS + azimuth;
        float row_t = LANE(a->row.x, lane), row_b = LANE(a->row.y, lane);
        float8 cell = row_t > 0.0f ? anisotropy_entry(a->scene, number, row_t, row_b)
                                   : vload8(0, RECORD(a->scene->layer_entries, number)->part);
        // One by one: Oclgrind's checks crash at shuffles of vectors of unequal length.
        float4 upper = (float4)(cell.s0, cell.s1, cell.s4, cell.s5), lower = (float4)(cell.s2, cell.s3, cell.s6, cell.s7);
        float4 values = mix(upper, lower, LANE(t, lane) - step);
        float2 found = mix(values.s02, values.s13, LANE(u, lane) - azimuth);
        lost.lane[lane] = found.x;
        bend.lane[lane] = found.y;
    }
    Bounce bounce;
    real far = maximum(1.0f - cosine - bend.all, ZERO);
    bounce.lost = minimum(maximum(lost.all, ZERO), ONE);
    bounce.by_f90 = (1.0f - bounce.lost) * square(square(far)) * far;
    bounce.by_f0 = 1.0f - bounce.lost - bounce.by_f90;
    return bounce;
}

// Hemispherical means of these fractions.
static inline Bounce anisotropic_mean(const Anisotropy *a) {
    RealLanes lost, by_f90;
    for (int lane = 0; lane < LANES; ++lane) {
        int number = LANE_INT(a->first, lane);
        float row_t = LANE(a->row.x, lane), row_b = LANE(a->row.y, lane);
        float8 mean = row_t > 0.0f ? anisotropy_entry(a->scene, number, row_t, row_b)
                                   : vload8(0, RECORD(a->scene->layer_entries, number)->part);
        lost.lane[lane] = mean.s0;
        by_f90.lane[lane] = mean.s1;
    }
    return (Bounce){1.0f - lost.all - by_f90.all, by_f90.all, lost.all};
}

static inline Bounce choose_bounce(ireal mask, Bounce a, Bounce b) {
    return (Bounce){mask ? a.by_f0 : b.by_f0, mask ? a.by_f90 : b.by_f90, mask ? a.lost : b.lost};
}

// The fractions of a single bounce at w, by fits on isotropic surfaces.
static inline Bounce bounce_at(const Anisotropy *a, const GgxAlbedo *isotropic, real3 w) {
    Bounce fitted = ggx_bounce(isotropic, maximum(w.z, ZERO));
    ireal turned = is_anisotropic(a);
    if (!ANY(turned)) return fitted;
    return choose_bounce(turned, anisotropic_bounce(a, w), fitted);
}
