// Sphere light that emits outwards: directions uniform over the cone it subtends (Shirley et al. 1996). World frame.
//
// The inner side of a double-sided sphere light is found by BSDF sampling only: from inside it covers all directions.
// So is the inner side seen from outside through a transparent near side: points are sampled on the near side.
#include "light/interface.cl"
#include OPACITY_FILE

// 1 − cos of the cone's half angle, without cancellation for a distant sphere. It is 0 from inside, where the sphere
// does not emit, and for points on the sphere itself, within their rounding error (surface/surface.cl), which see only
// its inside.
static inline real sphere_light_cone(real3 center, real radius, real3 to_center) {
    real sin2 = radius * radius / dot3(to_center, to_center);
    real reach = radius + (real)(GAMMA(32)) * (largest(absolute3(center)) + radius);
    ireal outside = dot3(to_center, to_center) > reach * reach;
    return outside ? sin2 / (1.0f + safe_sqrt(1.0f - sin2)) : ZERO;
}

static inline LightSample sphere_light_sample(const Scene *scene, ireal index, real3 p, real2 u) {
    real3 center = GATHER3(scene->sphere_lights, index, .center);
    real radius = GATHER(real, scene->sphere_lights, index, .radius);
    real3 to_center = sub(center, p);
    real distance = length3(to_center);
    real height = sphere_light_cone(center, radius, to_center);
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
#if OPACITY
    Hits sampled = {near, ZERO, ZERO, GATHER(ireal, scene->sphere_lights, index, .sphere)};
    Surface surface;
    sphere_surface(scene, p, s.wi, &sampled, sampled.primitive, &surface);
    s.radiance = scale(s.radiance, opacity_at(scene, &surface, s.wi, false));
#endif
    s.infinite = s.delta = NO_LANES;
    return s;
}

static inline real sphere_light_pdf(const Scene *scene, ireal index, real3 p, real3 wi, real t, const Surface *surface) {
    real3 center = GATHER3(scene->sphere_lights, index, .center);
    real height = sphere_light_cone(center, GATHER(real, scene->sphere_lights, index, .radius), sub(center, p));
    return ((height > 0.0f) & (dot3(wi, surface->ng) < 0.0f)) ? cone_pdf(height) : ZERO;
}

static inline real3 sphere_light_radiance(const Scene *scene, ireal index, real3 wi, const Surface *surface) {
    real3 radiance = GATHER3(scene->sphere_lights, index, .radiance);
#if EMISSION_TEXTURES
    radiance = textured3(scene, GATHER(ireal, scene->sphere_lights, index, .texture), radiance, &surface->at);
#endif
    ireal emits = dot3(wi, surface->ng) < 0.0f;
#if DOUBLE_SIDED_LIGHTS
    emits = emits | (GATHER(ireal, scene->sphere_lights, index, .double_sided) != 0);
#endif
    return choose(emits, radiance, splat(ZERO));
}
