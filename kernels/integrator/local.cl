// The integrators `local` and `raster`: direct lighting only, without interreflection (Whitted 1980, "An Improved
// Illumination Model for Shaded Display"; Nadolny 3.1 to 3.3, Suchiński 7.4 and 7.5).
//
// Perfect mirrors and smooth glass are followed; glass chooses reflection or refraction at random. The first other
// surface receives
//   direct light from every light that a shadow ray finds visible: delta lights cast hard shadows; area lights and
//   suns with a size are sampled at one point per sample, as by the path integrator. NO_SHADOWS: from all lights,
//   without shadow rays;
//   ambient light: that of the sky, unoccluded.
// World frame; L in W·sr⁻¹·m⁻².
#include "integrator/camera_rays.cl"
#include "light/dispatch.cl"
#include "surface/shading.cl"
#include "visibility/interface.cl"

// The lanes, of those that escape, that the environment lights.
#if ALPHA
#define LIT(clear, escaped) ((escaped) & !(clear))
#else
#define LIT(clear, escaped) escaped
#endif

// 1. Emission at the end of the ray: emissive surfaces and the environment.
static inline real3 seen_light(const Scene *scene, real3 origin, real3 direction, const Surface *surface, real t, ireal hit,
                               ireal escaped CAMERA_PARAMETER) {
    real3 L = splat(ZERO);
#if EMITTERS
    real pdf;
    L = choose(hit, emitter_radiance(scene, origin, direction, direction, t, surface, hit, &pdf), L);
#endif
#if ENVIRONMENT
    if (ANY(escaped)) L = choose(escaped, environment_radiance(scene, choose(escaped, direction, vector(ZERO, ONE, ZERO))
                                                               CAMERA_ARGUMENT(from_camera)), L);
#endif
    return L;
}

#if LIGHTS
// 2. Direct light of one light, with a shadow ray. absorption: on the viewer's side of the surface, per unit of
// length.
static inline real3 light_of_one(const Scene *scene, int light, const Surface *surface, const Shading *shading,
                                 real3 absorption, ireal active, real2 u, ureal *rays) {
    LightSample sample = sample_of_light(scene, (ireal)(light), surface->p, u);
    real3 contribution = scale(mul(shading_eval(shading, surface, sample.wi).value, sample.radiance), 1.0f / sample.pdf);
#if ATTENUATION
    real distance = sample.infinite ? (real)(INFINITY) : length3(sub(sample.target, surface->p));
    contribution = mul(contribution, attenuated(absorption_along(shading, surface, sample.wi, absorption), distance));
#endif
    ireal useful = active & (sample.pdf > 0.0f) & carries_light(contribution);
    if (!ANY(useful)) return splat(ZERO);
#if NO_SHADOWS
    return choose(useful, contribution, splat(ZERO));
#else
    real3 origin = offset_origin(surface->p, surface->p_error, surface->ng, sample.wi);
    *rays += useful ? (ureal)(1) : (ureal)(0);
    real visible = transmittance(scene, origin, (ireal)(light), sample.target, sample.wi, sample.infinite, useful);
    return choose(visible > 0.0f, scale(contribution, visible), splat(ZERO));
#endif
}
#endif

// Shade a non-specular surface: unoccluded ambient light of the sky, and the direct light of every light.
static inline real3 shade(const Scene *scene, const Surface *surface, const Shading *shading, real3 absorption, ireal active,
                          Sampler *sampler, ureal *rays) {
    real3 L = splat(ZERO);
#if SKY
    real pdf;
    real3 around = to_world(frame_around(surface->ns), sample_cosine(next_2d(sampler)));
    L = mul(bsdf_albedo(&shading->bsdf), sky_radiance(scene, choose(active, around, vector(ZERO, ONE, ZERO)), &pdf));
#endif
#if LIGHTS
    for (int light = 0; light < scene->counts.lights - scene->counts.sky_lights; ++light)
        L = add(L, light_of_one(scene, light, surface, shading, absorption, active, next_2d(sampler), rays));
#endif
    return choose(active, L, splat(ZERO));
}

// Return the radiance along camera rays. closest: their first hits, if those were rasterised.
static inline real3 local_light(const Scene *scene, const Launch *launch, const CameraRay *ray, const Hits *closest,
                                ireal active, Sampler *sampler, ureal *rays ALPHA_PARAMETER) {
#if ALPHA
    ireal clear = ALL_LANES;   // camera rays, and with CLEAR_GLASS those that smooth glass let through
#endif
    real3 L = splat(ZERO), beta = splat(ONE), origin = ray->origin, direction = ray->direction, absorption = splat(ZERO);
    for (int depth = 1;; ++depth) {
        *rays += active ? (ureal)(1) : (ureal)(0);
        // Intersect the ray with the scene
#if RASTER
        Hits next = depth == 1 ? *closest : closest_hit(scene, origin, direction, (real)(INFINITY), active);
        Hits hits = first_surface_from(scene, &next, origin, direction, depth == 1, active, sampler);
#else
        Hits hits = first_surface(scene, origin, direction, depth == 1, active, sampler);
#endif
        Surface surface = surface_at(scene, origin, direction, &hits);
        ireal hit = active & (hits.primitive >= 0);
#if ATTENUATION
        beta = mul(beta, attenuated(absorption, hit ? hits.t : (real)(INFINITY)));
#endif
        // Add emission at the hit, or of the environment
#if ALPHA
        real3 passed = choose(active & !hit & clear, beta, splat(ZERO));
        if (depth == 1) *alpha = hit ? ONE : ZERO;
        else *alpha -= (passed.x + passed.y + passed.z) * (1.0f / 3.0f);
#endif
        real3 seen = seen_light(scene, origin, direction, &surface, hits.t, hit, LIT(clear, active & !hit)
                                CAMERA_ARGUMENT(depth == 1));
        L = add(L, choose(active, mul(beta, seen), splat(ZERO)));
        active = hit;
        if (depth >= launch->max_depth || !ANY(active)) return L;
#if PRIMITIVES
        // Add direct light on non-specular surfaces
        Shading shading = shading_at(scene, direction, &surface);
        real2 u = next_2d(sampler), choice = next_2d(sampler);
        BsdfSample sample = shading_sample(&shading, &surface, u, choice.x);
        L = add(L, mul(beta, shade(scene, &surface, &shading, absorption, active & !sample.specular, sampler, rays)));

        // 3. Follow mirrors and glass
        direction = sample.wi;
        active = active & sample.specular & (sample.pdf > 0.0f);
#if CLEAR_GLASS
        clear = clear & (dot3(direction, surface.ng) < 0.0f);
#elif ALPHA
        clear = NO_LANES;
#endif
        beta = choose(active, mul(beta, sample.weight), beta);
#if TRANSMISSION
        beta = choose(active, scale(beta, sample.spread), beta);
#endif
#if ATTENUATION
        absorption = absorption_along(&shading, &surface, direction, absorption);
#endif
        origin = offset_origin(surface.p, surface.p_error, surface.ng, direction);
#endif
    }
}

static inline real3 seen_along(const Scene *scene, const Launch *launch, const CameraRay *ray, ireal active, Sampler *sampler,
                               ureal *rays, real3 *direct, real *removed ALPHA_PARAMETER) {
    return local_light(scene, launch, ray, 0, active, sampler, rays ALPHA_ARGUMENT(alpha));
}
