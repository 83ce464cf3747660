// Environment map: a latitude–longitude image. LIGHT_SKY: sampled where it is brighter than its mean. World frame.
//
// u = atan2(x, −z)/2·pi mod 1, v = acos(y)/pi, row 0 at the top; bilinear between texel centres, u wraps, v clamps. A
// row is sampled, then a texel in it, then a position in the texel uniformly in (u, v): density(u, v) per texel is
// constant, so pdf = density/(2·pi²·sin(pi·v)) (pbrt, 4th ed., 12.5.2). Directions are continuous in the random
// numbers.
#include "light/interface.cl"

static inline real2 sky_uv(const Scene *scene, real3 wi) {
    real c = (real)(RECORD(scene->environment, 0)->rotation_cos), s = (real)(RECORD(scene->environment, 0)->rotation_sin);
    real x = c * wi.x - s * wi.z, z = s * wi.x + c * wi.z;
    real u = atan2(x, -z) * (0.5f / PI);
    // Near a pole acos(y) loses half its digits; the arc's sine does not.
    real v = atan2(sqrt(x * x + z * z), wi.y) * (1.0f / PI);
    return (real2){u < 0.0f ? u + 1.0f : u, v};
}

static inline ireal clamp_index(ireal i, int size) { return i < 0 ? (ireal)(0) : i >= size ? (ireal)(size - 1) : i; }

static inline ireal sky_texel(const Scene *scene, real2 uv) {
    int width = RECORD(scene->environment, 0)->width, height = RECORD(scene->environment, 0)->height;
    return clamp_index(TO_INT(uv.y * (float)height), height) * width + clamp_index(TO_INT(uv.x * (float)width), width);
}

static inline float4 sky_texel_at(const Scene *scene, int texel) {
    return vload4(0, (global const float *)RECORD(scene->sky_texels, texel));
}

static inline real3 sky_radiance_uv(const Scene *scene, real2 uv) {
    int width = RECORD(scene->environment, 0)->width, height = RECORD(scene->environment, 0)->height;
    real x = uv.x * (float)width - 0.5f, y = uv.y * (float)height - 0.5f;
    ireal column = TO_INT(floor(x)), row = TO_INT(floor(y));
    real fx = x - TO_REAL(column), fy = y - TO_REAL(row);
    ireal left = column < 0 ? column + width : column;
    ireal right = column + 1 >= width ? column + 1 - width : column + 1;
    ireal top = clamp_index(row, height) * width, bottom = clamp_index(row + 1, height) * width;
    IntLanes corners[4] = {{top + left}, {top + right}, {bottom + left}, {bottom + right}};
    RealLanes r, g, b;
    for (int lane = 0; lane < LANES; ++lane) {
        float u = LANE(fx, lane), v = LANE(fy, lane);
        float4 upper = mix(sky_texel_at(scene, corners[0].lane[lane]), sky_texel_at(scene, corners[1].lane[lane]), u);
        float4 lower = mix(sky_texel_at(scene, corners[2].lane[lane]), sky_texel_at(scene, corners[3].lane[lane]), u);
        float4 radiance = mix(upper, lower, v);
        r.lane[lane] = radiance.x;
        g.lane[lane] = radiance.y;
        b.lane[lane] = radiance.z;
    }
    return (real3){r.all, g.all, b.all};
}

#if LIGHT_SKY
static inline real sky_pdf(const Scene *scene, ireal texel, real sin_theta) {
    real pdf = GATHER(real, scene->sky_texels, texel, .density) / (2.0f * PI * PI * sin_theta);
    return sin_theta > 0.0f ? pdf : ZERO;
}

// Sample a discrete distribution of n steps by inversion; u is rescaled to the position inside the step. `first`: start
// of its CDF in the table, which is searched from a guide entry: where the n-th of [0, 1) that holds u begins (Chen and
// Asau 1974).
static inline ireal pick_step(ARRAY(SkyStep) table, ireal first, int n, real *u) {
    ireal step = first + GATHER(ireal, table, first + TO_INT(*u * (float)n), .start);
    real top = GATHER(real, table, step, .top);
    for (ireal beyond = *u >= top; ANY(beyond); beyond = *u >= top) {
        step = beyond ? step + 1 : step;
        top = GATHER(real, table, step, .top);
    }
    real bottom = step > first ? GATHER(real, table, step > first ? step - 1 : step, .top) : ZERO;
    *u = (*u - bottom) / (top - bottom);
    return step - first;
}

static inline LightSample sky_light_sample(const Scene *scene, ireal index, real3 p, real2 u) {
    int width = RECORD(scene->environment, 0)->width, height = RECORD(scene->environment, 0)->height;
    real x = u.x, y = u.y;
    ireal row = pick_step(scene->sky_steps, (ireal)(width * height), height, &y);
    ireal column = pick_step(scene->sky_steps, row * width, width, &x), texel = row * width + column;
    real2 uv = {(TO_REAL(column) + x) / (float)width, (TO_REAL(row) + y) / (float)height};
    real sin_phi, cos_phi, sin_theta, cos_theta;
    sincos_turns(uv.x, &sin_phi, &cos_phi);
    sincos_turns(0.5f * uv.y, &sin_theta, &cos_theta);
    real east = sin_theta * sin_phi, south = -sin_theta * cos_phi;
    real c = (real)(RECORD(scene->environment, 0)->rotation_cos), s = (real)(RECORD(scene->environment, 0)->rotation_sin);
    LightSample sample;
    sample.wi = vector(c * east + s * south, cos_theta, c * south - s * east);
    sample.radiance = sky_radiance_uv(scene, uv);
    sample.pdf = sky_pdf(scene, texel, sin_theta);
    sample.target = sample.wi;
    sample.infinite = ALL_LANES;
    sample.delta = NO_LANES;
    return sample;
}
#else
static inline real sky_pdf(const Scene *scene, ireal texel, real sin_theta) { return ZERO; }
#endif

static inline real3 sky_radiance(const Scene *scene, real3 wi, real *pdf) {
    real2 uv = sky_uv(scene, wi);
    *pdf = sky_pdf(scene, sky_texel(scene, uv), sqrt(wi.x * wi.x + wi.z * wi.z));
    return sky_radiance_uv(scene, uv);
}
