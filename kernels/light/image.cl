// Images of lights: float texels in one buffer, a record for each image with its mapping (clrt/scene/light_images.py).
#include "core/bilinear.cl"

// The image at (u, v), from the upper left corner (0, 0) of what the light shows to the lower right one (1, 1).
static inline real3 light_image(const Scene *scene, ireal image, real u, real v) {
    real3 u_row = GATHER3(scene->light_images, image, .u_row), v_row = GATHER3(scene->light_images, image, .v_row);
    Bilinear around = bilinear(u_row.x * u + u_row.y * v + u_row.z, v_row.x * u + v_row.y * v + v_row.z,
                               GATHER(ireal, scene->light_images, image, .width),
                               GATHER(ireal, scene->light_images, image, .height),
                               GATHER(ireal, scene->light_images, image, .wrap_u),
                               GATHER(ireal, scene->light_images, image, .wrap_v),
                               GATHER(ireal, scene->light_images, image, .nearest) != 0);
    ireal first = GATHER(ireal, scene->light_images, image, .first);
    real3 value = splat(ZERO);
    EACH_TEXEL(i) {
        value = mad3(GATHER3(scene->light_texels, first + around.texel[i], .value), around.weight[i], value);
    }
    return value;
}

// Where a direction from the light meets the plane of an image at the distance 1 along the axis, from (−1, −1) at its
// lower left corner to (1, 1). across, upwards: unit vectors over half the image's size. Directions backwards have no
// such point; the axis is at (0, 0) for them.
static inline real2 on_image_plane(real3 away, real ahead, real3 across, real3 upwards) {
    real per = ahead > 0.0f ? 1.0f / ahead : ZERO;
    return (real2){dot3(away, across) * per, dot3(away, upwards) * per};
}
