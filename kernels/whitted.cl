// The `local` integrator: each light's own, directly, and none that surfaces send each other (Whitted 1980, "An Improved
// Illumination Model for Shaded Display"; Nadolny 3.1 to 3.3, Suchiński 7.4 and 7.5).
//
// Perfect mirrors and smooth glass are followed, glass at random by either way. On the first surface that is neither falls
//   the light of every lamp, point and beam that a shadow ray finds in sight: points and beams cast hard shadows; of lamps
//   with an area a point is drawn for every sample, as the path integrator does;
//   ambient light: the sky's, as if nothing stood in its way.
// World frame; L in W·sr⁻¹·m⁻².
#include "camera.cl"
#include "film.cl"
#include "bsdf.cl"
#include "light.cl"
#include VISIBILITY

// 1. What glows where the ray ended.
static inline real3 seen_light(const Scene *scene, real3 origin, real3 direction, const Surface *surface, real t, ireal hit,
                               ireal escaped) {
    real3 L = splat(ZERO);
    real pdf;
#if EMITTERS
    L = choose(hit, emitter_radiance(scene, origin, direction, direction, t, surface, hit, &pdf), L);
#endif
#if SKY
    if (ANY(escaped)) L = choose(escaped, sky_radiance(scene, choose(escaped, direction, vector(ZERO, ONE, ZERO)), &pdf), L);
#endif
    return L;
}

#if LIGHTS
// 2. One light's, by way of a shadow ray.
static inline real3 light_of_one(const Scene *scene, int light, const Surface *surface, const Bsdf *bsdf, Frame shading,
                                 real3 wo, ireal active, real2 u, ureal *rays) {
    LightSample sample = sample_of_light(scene, (ireal)(light), surface->p, u);
    real3 wi = to_local(shading, sample.wi);
    real3 contribution = scale(mul(bsdf_eval(bsdf, wo, wi), sample.radiance), 1.0f / sample.pdf);
    ireal useful = active & same_side(wi.z, dot3(sample.wi, surface->ng)) & (sample.pdf > 0.0f) & is_positive3(contribution);
    if (!ANY(useful)) return splat(ZERO);
    real3 origin = offset_origin(surface->p, surface->p_error, surface->ng, sample.wi);
    *rays += useful ? (ureal)(1) : (ureal)(0);
    real visible = transmittance(scene, origin, sample.target, sample.wi, sample.infinite, useful);
    return choose(visible > 0.0f, scale(contribution, visible), splat(ZERO));
}
#endif

static inline real3 shade(const Scene *scene, const Surface *surface, const Bsdf *bsdf, Frame shading, real3 wo, ireal active,
                          Sampler *sampler, ureal *rays) {
    real3 L = splat(ZERO);
#if SKY
    real pdf;
    real3 around = to_world(shading, sample_cosine(next_2d(sampler)));
    L = mul(bsdf_albedo(bsdf), sky_radiance(scene, choose(active, around, vector(ZERO, ONE, ZERO)), &pdf));
#endif
#if LIGHTS
    for (int light = 0; light < scene->counts.lights - scene->counts.sky_lights; ++light)
        L = add(L, light_of_one(scene, light, surface, bsdf, shading, wo, active, next_2d(sampler), rays));
#endif
    return choose(active, L, splat(ZERO));
}

static inline real3 local_light(const Scene *scene, real3 eye, real3 view, ireal active, int max_depth, Sampler *sampler,
                                ureal *rays) {
    real3 L = splat(ZERO), beta = splat(ONE), origin = eye, direction = view;
#if ATTENUATION
    real3 absorption = splat(ZERO);
#endif
    for (int depth = 1;; ++depth) {
        *rays += active ? (ureal)(1) : (ureal)(0);
        Surface surface;
        Hits hits = first_surface(scene, &origin, direction, active, sampler, &surface);
        ireal hit = active & (hits.primitive >= 0);
#if ATTENUATION
        beta = mul(beta, attenuated(absorption, hit ? hits.t : (real)(INFINITY)));
#endif
        real3 seen = seen_light(scene, origin, direction, &surface, hits.t, hit, active & !hit);
        L = add(L, choose(active, mul(beta, seen), splat(ZERO)));
        active = hit;
        if (depth >= max_depth || !ANY(active)) return L;
#if PRIMITIVES
        real3 towards = negate(direction);
#if NORMAL_MAPS
        bend_normal(scene, &surface);
#endif
        turn_towards(&surface, towards);
        Frame shading = frame_around(surface.ns);
        real3 wo = to_local(shading, towards);
        Bsdf bsdf;
        bsdf_at(scene, &surface, &bsdf);
        real2 u = next_2d(sampler), choice = next_2d(sampler);
        BsdfSample sample = bsdf_sample(&bsdf, wo, u, choice.x);
        L = add(L, mul(beta, shade(scene, &surface, &bsdf, shading, wo, active & !sample.specular, sampler, rays)));

        // 3. Go on from mirrors and glass.
        direction = to_world(shading, sample.wi);
        active = active & sample.specular & keeps_its_side(&sample, dot3(direction, surface.ng));
        beta = choose(active, mul(beta, sample.weight), beta);
#if TRANSMISSION
        beta = choose(active, scale(beta, sample.spread), beta);
#endif
#if ATTENUATION
        absorption = choose(sample.wi.z < 0.0f, absorption_beyond(&bsdf), absorption);
#endif
        origin = offset_origin(surface.p, surface.p_error, surface.ng, direction);
#endif
    }
}

__attribute__((vec_type_hint(real)))
kernel void whitted(SCENE_PARAMETERS, global Pixel *film, global const uint *tiles, const Launch launch) {
    Scene scene = SCENE_ARGUMENTS;
    LanePixels own;
    if (!lane_pixels(&launch, tiles, &own)) return;
    Accumulator pixels = load_pixels(film, AS_INT(own.index));
    for (uint s = 0; s < launch.sample_count; ++s) {
        Sampler sampler = sampler_at(own.code, (ureal)(launch.first_sample + s), launch.seed, launch.block_bits);
        CameraRay ray = camera_ray(&scene, &launch, own.x, own.y, next_2d(&sampler), &sampler);
        real3 L = local_light(&scene, ray.origin, ray.direction, own.inside, launch.max_depth, &sampler, &pixels.rays);
        accumulate(&pixels, L, own.inside);
    }
    store_pixels(film, own.index, own.inside, &pixels);
}
