// A sphere that shines outwards: a direction uniform over the cone it fills (Shirley et al. 1996). World frame.
#include "light/interface.cl"

// 1 − cos of the cone's half angle, without cancellation for a far sphere; 0 from inside, where nothing shines.
static inline real sphere_light_cone(real3 to_center, real radius) {
    real sin2 = radius * radius / dot3(to_center, to_center);
    return sin2 < 1.0f ? sin2 / (1.0f + safe_sqrt(1.0f - sin2)) : ZERO;
}

static inline LightSample sphere_light_sample(const Scene *scene, ireal index, real3 p, real2 u) {
    real3 center = GATHER3(scene->sphere_lights, index, .center);
    real radius = GATHER(real, scene->sphere_lights, index, .radius);
    real3 to_center = sub(center, p);
    real distance = length3(to_center);
    real height = sphere_light_cone(to_center, radius);
    ireal outside = height > 0.0f;
    LightSample s;
    real3 around = sample_cone(u, height);
    s.wi = to_world(frame_around(scale(to_center, 1.0f / distance)), around);
    s.pdf = outside ? cone_pdf(height) : ONE;
    real sin2 = around.x * around.x + around.y * around.y;
    real near = distance * around.z - safe_sqrt(radius * radius - distance * distance * sin2);
    real3 n = normalize3(sub(mad3(s.wi, near, p), center));
    s.target = shadow_target(p, mad3(n, radius, center), add(absolute3(center), splat(radius)), n);
    real3 radiance = GATHER3(scene->sphere_lights, index, .radiance);
#if EMISSION_TEXTURES
    Coordinates at = sphere_coordinates(n);
    radiance = textured3(scene, GATHER(ireal, scene->sphere_lights, index, .texture), radiance, &at);
#endif
    s.radiance = choose(outside, radiance, splat(ZERO));
    s.infinite = s.delta = NO_LANES;
    return s;
}

static inline real sphere_light_pdf(const Scene *scene, ireal index, real3 p, real3 wi, real t, const Surface *surface) {
    real3 to_center = sub(GATHER3(scene->sphere_lights, index, .center), p);
    return cone_pdf(sphere_light_cone(to_center, GATHER(real, scene->sphere_lights, index, .radius)));
}

static inline real3 sphere_light_radiance(const Scene *scene, ireal index, real3 wi, const Surface *surface) {
    real3 radiance = GATHER3(scene->sphere_lights, index, .radiance);
#if EMISSION_TEXTURES
    radiance = textured3(scene, GATHER(ireal, scene->sphere_lights, index, .texture), radiance, &surface->at);
#endif
    return choose(dot3(wi, surface->ng) < 0.0f, radiance, splat(ZERO));
}
