// Path tracing with light samples and multiple importance sampling (Kajiya 1986; Veach 1997, ch. 9 and 10).
//
// One work-item follows LANES pixels, one path each, through `sample_count` samples. World frame; L and Le in
// W·sr⁻¹·m⁻², beta the path's throughput.
#include "camera.cl"
#include "film.cl"
#include "bsdf.cl"
#include "light.cl"
#include VISIBILITY

#define ROULETTE_DEPTH 4   // edges before Russian roulette may end a path

// Where the last direction came from: its density, and whether only it could have found what lies there.
typedef struct {
    real3 p, n, wi;
    real pdf;
    ireal specular;
#if TRANSMISSION
    real spread;   // radiance at the eye over that here, by the media between (bsdf/interface.cl)
#endif
#if ATTENUATION
    real3 absorption;   // along wi, per unit of length
#endif
} Step;

#if TRANSMISSION
#define AT_EYE(L) scale(L, step.spread)
#else
#define AT_EYE(L) (L)
#endif

// 1. What glows where the ray ended, weighted against the light sample that could have found it.
static inline real3 found_light(const Scene *scene, const Step *step, const Surface *surface, real t, ireal hit,
                                ireal escaped) {
    real3 L = splat(ZERO);
#if EMITTERS
    real emitter_pdf;
    real3 emitted = emitter_radiance(scene, step->p, step->n, step->wi, t, surface, hit, &emitter_pdf);
    real emitter_weight = step->specular ? ONE : power_heuristic(step->pdf, emitter_pdf);
    L = choose(hit, scale(emitted, emitter_weight), L);
#endif
#if SKY
    if (ANY(escaped)) {
        real3 wi = choose(escaped, step->wi, vector(ZERO, ONE, ZERO));   // an idle lane's may be NaN, and so its texel
        real sky_pdf;
        real3 radiance = escaped_radiance(scene, step->p, step->n, wi, &sky_pdf);
        real weight = step->specular ? ONE : power_heuristic(step->pdf, sky_pdf);
        L = choose(escaped, scale(radiance, weight), L);
    }
#endif
    return L;
}

#if LIGHTS
// 2. Light that arrives by a shadow ray towards a sampled point of a light.
static inline real3 sampled_light(const Scene *scene, const Step *step, const Surface *surface, const Bsdf *bsdf,
                                  Frame shading, real3 wo, ireal active, Sampler *sampler, ureal *rays) {
    LightSample light = light_sample(scene, surface->p, choosing_normal(bsdf, surface->ns), sampler);
    real3 wi = to_local(shading, light.wi);
    ireal reachable = same_side(wi.z, dot3(light.wi, surface->ng));
    real3 f = bsdf_eval(bsdf, wo, wi);
    real3 contribution = mul(f, light.radiance);
    ireal useful = active & reachable & (light.pdf > 0.0f) & is_positive3(contribution);
    if (!ANY(useful)) return splat(ZERO);
    real3 origin = offset_origin(surface->p, surface->p_error, surface->ng, light.wi);
#if ATTENUATION
    real3 absorption = choose(wi.z > 0.0f, step->absorption, absorption_beyond(bsdf));
    real distance = light.infinite ? (real)(INFINITY) : length3(sub(light.target, origin));
    contribution = mul(contribution, attenuated(absorption, distance));
#endif
    *rays += useful ? (ureal)(1) : (ureal)(0);
    real visible = transmittance(scene, origin, light.target, light.wi, light.infinite, useful);
    real pdf = bsdf_pdf(bsdf, wo, wi);
    real weight = (light.delta ? ONE : power_heuristic(light.pdf, pdf)) / light.pdf;
    return choose(visible > 0.0f, scale(contribution, weight * visible), splat(ZERO));
}
#endif

// What arrives at the eye; direct: what of it came with two edges at most, where that is compiled in.
static inline real3 radiance(const Scene *scene, real3 eye, real3 direction, ireal active, int max_depth,
                             Sampler *sampler, ureal *rays, real3 *direct) {
    real3 L = splat(ZERO), beta = splat(ONE), origin = eye;
    Step step;
    step.p = eye;
    step.n = step.wi = direction;
    step.pdf = ONE;
    step.specular = ALL_LANES;
#if TRANSMISSION
    step.spread = ONE;
#endif
#if ATTENUATION
    step.absorption = splat(ZERO);
#endif
    for (int depth = 1;; ++depth) {
        *rays += active ? (ureal)(1) : (ureal)(0);
        Surface surface;
        Hits hits = first_surface(scene, &origin, step.wi, active, sampler, &surface);
        ireal hit = active & (hits.primitive >= 0);
#if ATTENUATION
        beta = mul(beta, attenuated(step.absorption, hit ? hits.t : (real)(INFINITY)));
#endif
        real3 found = found_light(scene, &step, &surface, hits.t, hit, active & !hit);
        L = add(L, choose(active, mul(beta, AT_EYE(found)), splat(ZERO)));
#if DIRECT_LIGHT
        if (depth <= 2) *direct = L;
#endif
        active = hit;
        if (depth >= max_depth || !ANY(active)) return L;

#if PRIMITIVES
        real3 towards = negate(step.wi);
#if NORMAL_MAPS
        bend_normal(scene, &surface);
#endif
        turn_towards(&surface, towards);
        Frame shading = frame_around(surface.ns);
        real3 wo = to_local(shading, towards);
        Bsdf bsdf;
        bsdf_at(scene, &surface, &bsdf);
#if LIGHTS
        real3 sampled = sampled_light(scene, &step, &surface, &bsdf, shading, wo, active, sampler, rays);
        L = add(L, mul(beta, AT_EYE(sampled)));
#endif
        // 3. Go on in a direction drawn from the material.
        real2 u = next_2d(sampler), choice = next_2d(sampler);
        BsdfSample sample = bsdf_sample(&bsdf, wo, u, choice.x);
        step.p = surface.p;
        step.n = choosing_normal(&bsdf, surface.ns);
        step.wi = to_world(shading, sample.wi);
        step.pdf = sample.pdf;
        step.specular = sample.specular;
        active = active & (sample.pdf > 0.0f) & is_positive3(sample.weight)
               & keeps_its_side(&sample, dot3(step.wi, surface.ng));
        beta = choose(active, mul(beta, sample.weight), beta);
#if TRANSMISSION
        step.spread *= sample.spread;
#endif
#if ATTENUATION
        step.absorption = choose(sample.wi.z < 0.0f, absorption_beyond(&bsdf), step.absorption);
#endif
        origin = offset_origin(surface.p, surface.p_error, surface.ng, step.wi);

        // 4. Russian roulette: end weak paths, keep the mean (Arvo and Kirk 1990). By the root of the throughput: fewer
        // are ended than by the throughput itself, and in rooms the error falls by more than the time grows.
        if (depth >= ROULETTE_DEPTH) {
            real survival = minimum(sqrt(largest(beta)), ONE);
            active = active & (choice.y < survival);
            beta = choose(active, scale(beta, 1.0f / survival), beta);
        }
#endif
    }
}

__attribute__((vec_type_hint(real)))
kernel void path(SCENE_PARAMETERS, global Pixel *film, global const uint *tiles, const Launch launch) {
    Scene scene = SCENE_ARGUMENTS;
    LanePixels own;
    if (!lane_pixels(&launch, tiles, &own)) return;
    Accumulator pixels = load_pixels(film, AS_INT(own.index));
    for (uint s = 0; s < launch.sample_count; ++s) {
        Sampler sampler = sampler_at(own.code, (ureal)(launch.first_sample + s), launch.seed, launch.block_bits);
        CameraRay ray = camera_ray(&scene, &launch, own.x, own.y, next_2d(&sampler), &sampler);
        real3 direct;
        real3 L = radiance(&scene, ray.origin, ray.direction, own.inside, launch.max_depth, &sampler, &pixels.rays,
                           &direct);
        ireal kept = accumulate(&pixels, L, own.inside);
#if DIRECT_LIGHT
        accumulate_direct(&pixels, direct, kept);
#endif
    }
    store_pixels(film, own.index, own.inside, &pixels);
}
