// Projector: intensity·image/d² within the image, 0 outside. If the image is of irradiance, it is divided by cos³ of the
// angle θ from the axis: a screen at the distance z along the axis receives image·cos θ/(d² cos³ θ) = image/z². World
// frame.
#include "light/interface.cl"
#include "light/image.cl"

static inline LightSample projector_light_sample(const Scene *scene, ireal index, real3 p, real2 u) {
    real d2;
    LightSample s = sample_of_point(GATHER3(scene->projector_lights, index, .position), p, &d2);
    real inverse = rsqrt(d2);
    real3 away = scale(s.wi, -ONE);
    real ahead = dot3(away, GATHER3(scene->projector_lights, index, .axis));
    real2 at = on_image_plane(away, ahead, GATHER3(scene->projector_lights, index, .across),
                              GATHER3(scene->projector_lights, index, .upwards));
    ireal shown = (ahead > 0.0f) & (fabs(at.x) <= 1.0f) & (fabs(at.y) <= 1.0f);
    real3 image = light_image(scene, GATHER(ireal, scene->projector_lights, index, .image), 0.5f + 0.5f * at.x,
                              0.5f - 0.5f * at.y);
    ireal of_irradiance = GATHER(real, scene->projector_lights, index, .of_irradiance) > 0.0f;
    real share = of_irradiance ? 1.0f / (ahead * ahead * ahead) : ONE;
    share = shown ? share * inverse * inverse : ZERO;
    s.radiance = scale(mul(GATHER3(scene->projector_lights, index, .intensity), image), share);
#if LIGHT_RANGES
    s.radiance = scale(s.radiance, within_range(d2, GATHER(real, scene->projector_lights, index, .per_range2)));
#endif
    return s;
}
