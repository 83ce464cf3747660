// Textures: texels of 8 bits per channel in one buffer, a record for each use of an image
// (clrt/scene/materials/textures.py).
//
// Coordinates as in glTF: (0, 0) is the upper left corner of the image. Colours are decoded from sRGB by a table before
// they are filtered; numbers are linear.
#include "core/bilinear.cl"

// Texture coordinates of a surface point, for each set.
typedef struct { real2 set[UV_SETS]; } Coordinates;

#if TRIANGLES
static inline Coordinates triangle_coordinates(const Scene *scene, ireal primitive, real b0, real b1, real b2) {
    Coordinates at;
    for (int i = 0; i < UV_SETS; ++i) {
        ireal own = primitive * UV_SETS + i;
#define CORNERS(name) b0 * GATHER(real, scene->texcoords, own, .uv0[name]) \
                    + b1 * GATHER(real, scene->texcoords, own, .uv1[name]) \
                    + b2 * GATHER(real, scene->texcoords, own, .uv2[name])
        at.set[i] = (real2){CORNERS(0), CORNERS(1)};
    }
    return at;
}
#endif

#if SPHERES
// The image wraps once around the sphere, its centre towards +z, its top towards +y.
static inline Coordinates sphere_coordinates(real3 n) {
    real u = 0.5f + atan2(n.x, n.z) * (0.5f / PI);
    real y = n.y < -1.0f ? -ONE : (n.y < 1.0f ? n.y : ONE);
    Coordinates at;
    for (int i = 0; i < UV_SETS; ++i) at.set[i] = (real2){u, acos(y) * (1.0f / PI)};
    return at;
}
#endif

// Four texels and their weights, by rows.
typedef struct {
    ureal texel[4];
    real weight[4];
} Footprint;

static inline Footprint footprint(const Scene *scene, ireal texture, const Coordinates *at) {
    real u = at->set[0].x, v = at->set[0].y;
#if UV_SETS > 1
    ireal second = GATHER(ireal, scene->textures, texture, .uv_set) != 0;
    u = second ? at->set[1].x : u;
    v = second ? at->set[1].y : v;
#endif
    real3 u_row = GATHER3(scene->textures, texture, .u_row), v_row = GATHER3(scene->textures, texture, .v_row);
    ireal wrap_u = GATHER(ireal, scene->textures, texture, .wrap_u), wrap_v = GATHER(ireal, scene->textures, texture, .wrap_v);
    ireal width = GATHER(ireal, scene->textures, texture, .width), height = GATHER(ireal, scene->textures, texture, .height);
    Bilinear around = bilinear(u_row.x * u + u_row.y * v + u_row.z, v_row.x * u + v_row.y * v + v_row.z, width, height,
                               wrap_u, wrap_v, GATHER(ireal, scene->textures, texture, .nearest) != 0);
    ireal first = GATHER(ireal, scene->textures, texture, .first);
    Footprint found;
    EACH_TEXEL(i) {
        found.texel[i] = GATHER(ureal, scene->texels, first + around.texel[i], .rgba);
        found.weight[i] = around.weight[i];
    }
    return found;
}

static inline real decoded(const Scene *scene, ureal texel, uint shift) {
    return GATHER(real, scene->srgb, AS_INT(texel >> shift & 255u), .linear);
}

// The texture times the factor, or the factor if there is no texture (−1).
static inline real3 textured3(const Scene *scene, ireal texture, real3 factor, const Coordinates *at) {
    ireal present = texture >= 0;
    if (!ANY(present)) return factor;
    Footprint found = footprint(scene, present ? texture : (ireal)(0), at);
    real3 color = splat(ZERO);
    EACH_TEXEL(i) {
        ureal texel = found.texel[i];
        real3 decoded3 = vector(decoded(scene, texel, 0), decoded(scene, texel, 8), decoded(scene, texel, 16));
        color = mad3(decoded3, found.weight[i], color);
    }
    return choose(present, mul(color, factor), factor);
}

// A channel of the texture, from 0 to 1; shift: eight times its index.
static inline real filtered(const Footprint *found, ureal shift) {
    real sum = ZERO;
    EACH_TEXEL(i) sum += TO_REAL(found->texel[i] >> shift & 255u) * found->weight[i];
    return sum * (1.0f / 255.0f);
}

static inline real textured(const Scene *scene, ireal texture, real factor, const Coordinates *at) {
    ireal present = texture >= 0;
    if (!ANY(present)) return factor;
    texture = present ? texture : (ireal)(0);
    Footprint found = footprint(scene, texture, at);
    real value = filtered(&found, GATHER(ureal, scene->textures, texture, .shift));
    return present ? value * factor : factor;
}
