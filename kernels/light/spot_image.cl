// Spot light with an image: intensity·falloff·image/d², where the image's square touches the outer cone. World frame.
#include "light/cone.cl"
#include "light/image.cl"

static inline LightSample spot_image_light_sample(const Scene *scene, ireal index, real3 p, real2 u) {
    real d2;
    LightSample s = sample_of_point(GATHER3(scene->spot_image_lights, index, .position), p, &d2);
    real3 axis = GATHER3(scene->spot_image_lights, index, .axis);
    real inverse = rsqrt(d2);
    real f = cone_factor(s.wi, axis, GATHER(real, scene->spot_image_lights, index, .outer),
                         GATHER(real, scene->spot_image_lights, index, .slope)) * inverse;
    real3 away = scale(s.wi, -ONE);
    real2 at = on_image_plane(away, dot3(away, axis), GATHER3(scene->spot_image_lights, index, .across),
                              GATHER3(scene->spot_image_lights, index, .upwards));
    real3 image = light_image(scene, GATHER(ireal, scene->spot_image_lights, index, .image), 0.5f + 0.5f * at.x,
                              0.5f - 0.5f * at.y);
    s.radiance = scale(mul(GATHER3(scene->spot_image_lights, index, .intensity), image), f * f);
#if LIGHT_RANGES
    s.radiance = scale(s.radiance, within_range(d2, GATHER(real, scene->spot_image_lights, index, .per_range2)));
#endif
    return s;
}
