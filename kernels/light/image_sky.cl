// Light from a latitude–longitude picture, sampled by its brightness. World frame.
//
// u = atan2(x, −z)/2·pi mod 1, v = acos(y)/pi, row 0 on top; bilinear between texel centres, u wraps, v clamps. A
// texel is drawn with the mean bilinear luminance over its area times its solid angle, the place inside it uniformly
// in (u, v): density(u, v) per texel is constant, so pdf = density/(2·pi²·sin(pi·v)) (pbrt, 4th ed., 12.5.2).
#include "light/interface.cl"

static inline real2 sky_uv(const Scene *scene, real3 wi) {
    real c = (real)(scene->environment->rotation_cos), s = (real)(scene->environment->rotation_sin);
    real x = c * wi.x - s * wi.z, z = s * wi.x + c * wi.z;
    real u = atan2(x, -z) * (0.5f / PI);
    // Near a pole acos(y) loses half its digits and the arc's sine does not.
    real v = atan2(sqrt(x * x + z * z), wi.y) * (1.0f / PI);
    return (real2){u < 0.0f ? u + 1.0f : u, v};
}

static inline ireal clamp_index(ireal i, int size) { return i < 0 ? (ireal)(0) : i >= size ? (ireal)(size - 1) : i; }

static inline ireal sky_texel(const Scene *scene, real2 uv) {
    int width = scene->environment->width, height = scene->environment->height;
    return clamp_index(TO_INT(uv.y * (float)height), height) * width + clamp_index(TO_INT(uv.x * (float)width), width);
}

static inline float4 sky_texel_at(const Scene *scene, int texel) {
    return vload4(0, (global const float *)(scene->sky_texels + texel));
}

static inline real3 sky_radiance_uv(const Scene *scene, real2 uv) {
    int width = scene->environment->width, height = scene->environment->height;
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

static inline real sky_pdf_at(const Scene *scene, ireal texel, real sin_theta) {
    real pdf = GATHER(real, scene->sky_texels, texel, .density) / (2.0f * PI * PI * sin_theta);
    return sin_theta > 0.0f ? pdf : ZERO;
}

static inline real3 sky_radiance(const Scene *scene, real3 wi, real *pdf) {
    real2 uv = sky_uv(scene, wi);
    *pdf = scene->environment->probability
         * sky_pdf_at(scene, sky_texel(scene, uv), sqrt(wi.x * wi.x + wi.z * wi.z));
    return sky_radiance_uv(scene, uv);
}

static inline LightSample sky_light_sample(const Scene *scene, ireal index, real3 p, real2 u, ureal2 bits) {
    int width = scene->environment->width, height = scene->environment->height;
    ALIAS_PICK(scene->sky_aliases, width * height, bits, texel)
    ireal row = texel / width, column = texel - row * width;
    real2 uv = {(TO_REAL(column) + u.x) / (float)width, (TO_REAL(row) + u.y) / (float)height};
    real sin_phi, cos_phi, sin_theta, cos_theta;
    sincos_turns(uv.x, &sin_phi, &cos_phi);
    sincos_turns(0.5f * uv.y, &sin_theta, &cos_theta);
    real x = sin_theta * sin_phi, z = -sin_theta * cos_phi;
    real c = (real)(scene->environment->rotation_cos), s = (real)(scene->environment->rotation_sin);
    LightSample sample;
    sample.wi = vector(c * x + s * z, cos_theta, c * z - s * x);
    sample.radiance = sky_radiance_uv(scene, uv);
    sample.pdf = sky_pdf_at(scene, texel, sin_theta);
    sample.target = sample.wi;
    sample.infinite = ALL_LANES;
    sample.delta = NO_LANES;
    return sample;
}
