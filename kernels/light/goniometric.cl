// Goniometric light: intensity·image/d², where the image is equirectangular, its centre along the axis. World frame.
#include "light/interface.cl"
#include "light/image.cl"

static inline LightSample goniometric_light_sample(const Scene *scene, ireal index, real3 p, real2 u) {
    real d2;
    LightSample s = sample_of_point(GATHER3(scene->goniometric_lights, index, .position), p, &d2);
    real inverse = rsqrt(d2);
    real ahead = -dot3(s.wi, GATHER3(scene->goniometric_lights, index, .axis));
    real right = -dot3(s.wi, GATHER3(scene->goniometric_lights, index, .right));
    real top = -dot3(s.wi, GATHER3(scene->goniometric_lights, index, .top));
    // Near a pole the arc's cosine loses half its digits; its sine does not.
    real column = 0.5f + atan2(right, ahead) * (0.5f / PI);
    real row = atan2(sqrt(ahead * ahead + right * right), top) * (1.0f / PI);
    real3 image = light_image(scene, GATHER(ireal, scene->goniometric_lights, index, .image), column, row);
    s.radiance = scale(mul(GATHER3(scene->goniometric_lights, index, .intensity), image), inverse * inverse);
#if LIGHT_RANGES
    s.radiance = scale(s.radiance, within_range(d2, GATHER(real, scene->goniometric_lights, index, .per_range2)));
#endif
    return s;
}
