// Path tracing with light samples and multiple importance sampling (Kajiya 1986; Veach 1997, ch. 9 and 10): what happens
// along an edge of a path. path.cl and wave.cl put these stages together; each is for the edges in all lanes.
//
// World frame; light in W·sr⁻¹·m⁻². Light is returned as what reaches the eye, 0 in lanes that are not asked for.
#include "light.cl"
#include "shading.cl"
#include VISIBILITY

#define ROULETTE_DEPTH 4   // edges before Russian roulette may end a path

// A path that sets out on its next edge, from `origin` along `wi`.
typedef struct {
    real3 origin, wi;
    real3 p, n;            // the point that it leaves, and the normal there
    real pdf;              // density of wi
    ireal specular;        // whether wi alone could have found what lies there
    real3 beta;            // throughput
#if TRANSMISSION
    real spread;           // radiance at the eye over that here, by the media between (bsdf/interface.cl)
#endif
#if ATTENUATION
    real3 absorption;      // along wi, per unit of length
#endif
} Path;

static inline Path path_along(real3 eye, real3 direction) {
    Path path;
    path.origin = path.p = eye;
    path.wi = path.n = direction;
    path.pdf = ONE;
    path.specular = ALL_LANES;
    path.beta = splat(ONE);
#if TRANSMISSION
    path.spread = ONE;
#endif
#if ATTENUATION
    path.absorption = splat(ZERO);
#endif
    return path;
}

static inline real3 at_eye(const Path *path, real3 L) {
#if TRANSMISSION
    return mul(path->beta, scale(L, path->spread));
#else
    return mul(path->beta, L);
#endif
}

#if CLAMP
// The factor that clamps a contribution to a sample, whose path has so many edges: it makes the largest channel at most
// clamp_direct (up to two edges, as in Cycles) or clamp_indirect.
static inline real clamp_factor(const Launch *launch, real3 light, int edges) {
    real limit = (real)(edges <= 2 ? launch->clamp_direct : launch->clamp_indirect), most = largest(light);
    return most > limit ? limit / most : ONE;
}

// The clamped contribution. *removed gains the mean of the channels of what that removes.
static inline real3 clamped(const Launch *launch, real3 light, int edges, real *removed) {
    real part = clamp_factor(launch, light, edges);
    *removed += (1.0f - part) * (light.x * (1.0f / 3.0f) + light.y * (1.0f / 3.0f) + light.z * (1.0f / 3.0f));
    return scale(light, part);
}
#else
#define clamp_factor(launch, light, edges) ONE
#define clamped(launch, light, edges, removed) (light)
#endif

// What is absorbed on the way to where the ray ended.
static inline void absorb(Path *path, real distance) {
#if ATTENUATION
    path->beta = mul(path->beta, attenuated(path->absorption, distance));
#endif
}

// 1. What glows where the rays ended, weighted against the light sample that could have found it: surfaces …
static inline real3 emitted_light(const Scene *scene, const Path *path, const Surface *surface, real t, ireal hit) {
#if EMITTERS
    real pdf;
    real3 emitted = emitter_radiance(scene, path->p, path->n, path->wi, t, surface, hit, &pdf);
    real weight = path->specular ? ONE : bsdf_sample_weight(path->pdf, pdf);
    return choose(hit, at_eye(path, scale(emitted, weight)), splat(ZERO));
#else
    return splat(ZERO);
#endif
}

// … and the environment: the sky, and suns with a size.
static inline real3 escaped_light(const Scene *scene, const Path *path, ireal escaped) {
#if ENVIRONMENT
    if (!ANY(escaped)) return splat(ZERO);
    real3 wi = choose(escaped, path->wi, vector(ZERO, ONE, ZERO));   // an idle lane's may be NaN, and so its texel
    real3 light = environment_light(scene, path->p, path->n, wi, path->pdf, path->specular);
    return choose(escaped, at_eye(path, light), splat(ZERO));
#else
    return splat(ZERO);
#endif
}

#if PRIMITIVES
#if LIGHTS
// A ray towards a sampled point of a light, and what comes along it if nothing is in between.
typedef struct {
    real3 origin, target, wi;
    ireal infinite;
    real3 light;
} ShadowRay;

// 2. Light by shadow rays: which lanes send one.
static inline ireal aim_at_light(const Scene *scene, const Path *path, const Surface *surface, const Shading *shading,
                                 ireal active, Sampler *sampler, ShadowRay *ray) {
    LightSample light = light_sample(scene, surface->p, choosing_normal(shading), sampler);
    BsdfValue bsdf = shading_eval(shading, surface, light.wi);
    real3 contribution = mul(bsdf.value, light.radiance);
    ireal useful = active & !(light.pdf <= 0.0f) & carries_light(contribution);
    if (!ANY(useful)) return useful;
    ray->origin = offset_origin(surface->p, surface->p_error, surface->ng, light.wi);
    ray->target = light.target;
    ray->wi = light.wi;
    ray->infinite = light.infinite;
#if ATTENUATION
    real3 absorption = absorption_along(shading, surface, light.wi, path->absorption);
    real distance = light.infinite ? (real)(INFINITY) : length3(sub(light.target, ray->origin));
    contribution = mul(contribution, attenuated(absorption, distance));
#endif
    real weight = (light.delta ? ONE : light_sample_weight(light.pdf, bsdf.pdf)) / light.pdf;
    ray->light = at_eye(path, scale(contribution, weight));
    return useful;
}

static inline real3 light_along(const Scene *scene, const ShadowRay *ray, ireal sent) {
    real visible = transmittance(scene, ray->origin, ray->target, ray->wi, ray->infinite, sent);
    return choose(visible > 0.0f, scale(ray->light, visible), splat(ZERO));
}
#endif

// 3. On in a direction drawn from the material: which paths do go on. None does on a last edge where nothing glows that it
// could meet.
static inline ireal go_on(Path *path, const Surface *surface, const Shading *shading, ireal active, int depth,
                          int max_depth, Sampler *sampler) {
#if !(EMITTERS || ENVIRONMENT)
    if (depth + 1 >= max_depth) return NO_LANES;
#endif
    real2 u = next_2d(sampler), choice = next_2d(sampler);
    BsdfSample sample = shading_sample(shading, surface, u, choice.x);
    path->wi = sample.wi;
    path->p = surface->p;
    path->n = choosing_normal(shading);
    path->pdf = sample.pdf;
    path->specular = sample.specular;
    active = active & !(sample.pdf <= 0.0f) & carries_light(sample.weight);
    path->beta = choose(active, mul(path->beta, sample.weight), path->beta);
#if TRANSMISSION
    path->spread *= sample.spread;
#endif
#if ATTENUATION
    path->absorption = absorption_along(shading, surface, path->wi, path->absorption);
#endif
    path->origin = offset_origin(surface->p, surface->p_error, surface->ng, path->wi);

    // 4. Russian roulette: end weak paths, keep the mean (Arvo and Kirk 1990). Those that go on have a throughput of a
    // third at least: in rooms the error falls by more than the time grows.
    if (depth >= ROULETTE_DEPTH) {
        real survival = minimum(3.0f * largest(path->beta), ONE);
        active = active & (choice.y < survival);
        path->beta = choose(active, scale(path->beta, 1.0f / survival), path->beta);
    }
    return active;
}
#endif
