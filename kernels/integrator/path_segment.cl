// Path tracing with next-event estimation and multiple importance sampling (Kajiya 1986; Veach 1997, ch. 9 and 10):
// the stages of one path segment, which integrator/path.cl and integrator/wavefront.cl combine. Each stage processes
// all lanes.
//
// World frame; radiance in W·sr⁻¹·m⁻². Light is returned as its contribution at the camera, 0 in inactive lanes.
#include "light/dispatch.cl"
#include "surface/shading.cl"
#include "visibility/interface.cl"
#include GUIDING_FILE

#define ROULETTE_DEPTH 4       // path depth from which Russian roulette may end a path
#define LEAST_SURVIVAL 0.1f    // probability with which guided paths survive it at least

// State of a path whose next segment starts at `origin` in direction `wi`.
typedef struct {
    real3 origin, wi;
    real3 p, n;            // previous path vertex and its normal
    real pdf;              // density with which wi was sampled
    ireal specular;        // whether wi is a specular direction, which light sampling cannot find
    real3 beta;            // throughput
#if TRANSMISSION
    real spread;           // radiance at the camera over radiance here, from the media crossed (bsdf/interface.cl)
#endif
#if ATTENUATION
    real3 absorption;      // absorption coefficient along wi, per unit of length
#endif
#if CLEAR_GLASS
    ireal clear;           // whether it has only passed through smooth glass
#endif
#if GUIDING
    real expected;         // luminance expected at the camera from the first vertex on, 0 before it
#endif
#if TRAINING
    real bsdf_pdf;         // density of wi as sampled from the BSDF alone
    real weight;           // luminance of the sample's weight
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
#if CLEAR_GLASS
    path.clear = ALL_LANES;
#endif
#if GUIDING
    path.expected = ZERO;
#endif
#if TRAINING
    path.bsdf_pdf = path.weight = ONE;
#endif
    return path;
}

// Densities of directions, and their samples: those of the BSDF, if paths are not guided.
#if !GUIDING
#define GUIDING_PARAMETER
#define GUIDING_ARGUMENT(guiding)
#define GUIDING_AT(guiding, scene, surface)
#define guided_pdf(scene, guiding, wi, bsdf_pdf) bsdf_pdf
#define guided_sample(scene, guiding, shading, surface, u, choice, bsdf_pdf) shading_sample(shading, surface, u, choice)
#endif

// The contribution at the camera of radiance L that arrives along the current segment.
static inline real3 at_eye(const Path *path, real3 L) {
#if TRANSMISSION
    return mul(path->beta, scale(L, path->spread));
#else
    return mul(path->beta, L);
#endif
}

#if CLAMP
// The factor that clamps a contribution of a path of `edges` segments to a sample: it limits the largest channel to
// clamp_direct (up to two segments, as in Cycles) or to clamp_indirect.
static inline real clamp_factor(const Launch *launch, real3 light, int edges) {
    real limit = (real)(edges <= 2 ? launch->clamp_direct : launch->clamp_indirect), most = largest(light);
    return most > limit ? limit / most : ONE;
}

// Return the clamped contribution; add the mean over the channels of the energy removed to *removed.
static inline real3 clamped(const Launch *launch, real3 light, int edges, real *removed) {
    real part = clamp_factor(launch, light, edges);
    *removed += (1.0f - part) * (light.x * (1.0f / 3.0f) + light.y * (1.0f / 3.0f) + light.z * (1.0f / 3.0f));
    return scale(light, part);
}
#else
#define clamp_factor(launch, light, edges) ONE
#define clamped(launch, light, edges, removed) (light)
#endif

// Apply the absorption along the segment that ends after `distance`.
static inline void absorb(Path *path, real distance) {
#if ATTENUATION
    path->beta = mul(path->beta, attenuated(path->absorption, distance));
#endif
}

#if ALPHA
// Whether a path that escapes shows what is behind the scene, not its environment: a camera ray, or with CLEAR_GLASS one
// that smooth glass let through.
static inline ireal sees_through(const Path *path, int depth) {
#if CLEAR_GLASS
    return path->clear;
#else
    return depth == 1 ? ALL_LANES : NO_LANES;
#endif
}

// What a segment adds to the coverage of its sample: 1 where a camera ray hits something, less what glass lets through.
static inline real coverage(const Path *path, int depth, ireal hit, ireal escaped) {
    if (depth == 1) return hit ? ONE : ZERO;
#if CLEAR_GLASS
    real3 passed = at_eye(path, splat(ONE));
    return (escaped & path->clear) ? (passed.x + passed.y + passed.z) * (-1.0f / 3.0f) : ZERO;
#else
    return ZERO;
#endif
}

// The lanes, of those that hit something at depth 1, where that is not a catcher.
#if CATCHER
#define COVERING(hit, caught) (hit) & !(caught)
#else
#define COVERING(hit, caught) hit
#endif

// The lanes, of those that escape, that the environment lights.
#define LIT(path, depth, escaped) ((escaped) & !sees_through(path, depth))
#else
#define LIT(path, depth, escaped) escaped
#endif

// 1. Emission at the end of the segment, with its MIS weight against light sampling: emissive surfaces …
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
static inline real3 escaped_light(const Scene *scene, const Path *path, ireal escaped CAMERA_PARAMETER PARTS_PARAMETER) {
#if ENVIRONMENT
    if (!ANY(escaped)) return splat(ZERO);
    real3 wi = choose(escaped, path->wi, vector(ZERO, ONE, ZERO));   // NaN in inactive lanes gives no valid texel
    real3 light = environment_light(scene, path->p, path->n, wi, path->pdf, path->specular CAMERA_ARGUMENT(from_camera)
                                    PARTS_ARGUMENT(parts));
#if EMITTER_GROUPS
    for (int g = 0; g < GROUPS; ++g) parts[g] = choose(escaped, at_eye(path, parts[g]), splat(ZERO));
#endif
    return choose(escaped, at_eye(path, light), splat(ZERO));
#else
    return splat(ZERO);
#endif
}

#if LIGHTS && (PRIMITIVES || LISTED_RAYS)
// A shadow ray to a sampled point on a light, and its contribution if it is unoccluded.
typedef struct {
    real3 origin, target, wi;
    ireal infinite;
#if OPACITY || EMITTER_GROUPS
    ireal light;           // where it ends, see transmittance
#endif
    real3 contribution;
} ShadowRay;

// Set where a shadow ray starts, at a point of a surface, and where it ends: at light `number`.
static inline void aim(ShadowRay *ray, real3 p, real3 p_error, real3 ng, const LightSample *light, ireal number) {
    ray->origin = offset_origin(p, p_error, ng, light->wi);
    ray->target = light->target;
    ray->wi = light->wi;
    ray->infinite = light->infinite;
#if OPACITY || EMITTER_GROUPS
    ray->light = number;
#endif
}

// Trace the shadow rays of the lanes `sent`; return their contributions.
static inline real3 light_along(const Scene *scene, const ShadowRay *ray, ireal sent) {
#if OPACITY
    ireal light = ray->light;
#else
    ireal light = (ireal)(-1);
#endif
    real visible = transmittance(scene, ray->origin, light, ray->target, ray->wi, ray->infinite, sent);
    return choose(visible > 0.0f, scale(ray->contribution, visible), splat(ZERO));
}
#endif

#if PRIMITIVES
#if LIGHTS
// 2. Next-event estimation: sample a light and the shadow ray to it. Returns the lanes that need a shadow ray.
static inline ireal aim_at_light(const Scene *scene, const Path *path, const Surface *surface, const Shading *shading,
                                 ireal active, Sampler *sampler, ShadowRay *ray GUIDING_PARAMETER) {
    ireal number;
    LightSample light = light_sample(scene, surface->p, choosing_normal(shading), sampler, &number);
    BsdfValue bsdf = shading_eval(shading, surface, light.wi);
    real3 contribution = mul(bsdf.value, light.radiance);
    ireal useful = active & !(light.pdf <= 0.0f) & carries_light(contribution);
    if (!ANY(useful)) return useful;
    aim(ray, surface->p, surface->p_error, surface->ng, &light, number);
#if ATTENUATION
    real3 absorption = absorption_along(shading, surface, light.wi, path->absorption);
    real distance = light.infinite ? (real)(INFINITY) : length3(sub(light.target, ray->origin));
    contribution = mul(contribution, attenuated(absorption, distance));
#endif
    real pdf = guided_pdf(scene, guiding, light.wi, bsdf.pdf);
    real weight = (light.delta ? ONE : light_sample_weight(light.pdf, pdf)) / light.pdf;
    ray->contribution = at_eye(path, scale(contribution, weight));
    return useful;
}

#endif

// 3. Sample the BSDF, or the guiding field, for the direction of the next segment. Returns the lanes whose paths
// continue: none if the next segment is the last one and the scene has neither emitters nor an environment that it could
// find.
static inline ireal go_on(const Scene *scene, Path *path, const Surface *surface, const Shading *shading, ireal active,
                          int depth, int max_depth, Sampler *sampler GUIDING_PARAMETER) {
#if !(EMITTERS || ENVIRONMENT)
    if (depth + 1 >= max_depth) return NO_LANES;
#endif
    real2 u = next_2d(sampler), choice = next_2d(sampler);
#if GUIDING
    real bsdf_pdf, expected = luminance(at_eye(path, splat(guiding->reflected)));
#endif
    BsdfSample sample = guided_sample(scene, guiding, shading, surface, u, choice.x, &bsdf_pdf);
#if TRAINING
    path->bsdf_pdf = bsdf_pdf;
    path->weight = sample.pdf > 0.0f ? luminance(sample.weight) : ZERO;
#endif
    path->wi = sample.wi;
    path->p = surface->p;
    path->n = choosing_normal(shading);
    path->pdf = sample.pdf;
    path->specular = sample.specular;
#if CLEAR_GLASS
    path->clear = path->clear & sample.specular & (dot3(sample.wi, surface->ng) < 0.0f);
#endif
    active = active & !(sample.pdf <= 0.0f) & carries_light(sample.weight);
    path->beta = choose(active, mul(path->beta, sample.weight), path->beta);
#if TRANSMISSION
    path->spread *= sample.spread;
#endif
#if ATTENUATION
    path->absorption = absorption_along(shading, surface, path->wi, path->absorption);
#endif
    path->origin = offset_origin(surface->p, surface->p_error, surface->ng, path->wi);

    // 4. Russian roulette: end paths of low throughput without bias (Arvo and Kirk 1990). Survivors have a throughput
    // of at least 1/3: in interiors the error falls by more than the time grows. Guided paths, whose throughput falls
    // where light is strong, end by the light expected of them (Vorba and Křivánek 2016).
#if GUIDING
    ireal first = !(path->expected > 0.0f) & !path->specular;
    path->expected = first ? expected : path->expected;
#endif
    if (depth >= ROULETTE_DEPTH) {
        real survival = minimum(3.0f * largest(path->beta), ONE);
#if GUIDING
        ireal known = (path->expected > 0.0f) & !path->specular;
        survival = known ? minimum(maximum(expected / path->expected, (real)(LEAST_SURVIVAL)), ONE) : survival;
#endif
        active = active & (choice.y < survival);
        path->beta = choose(active, scale(path->beta, 1.0f / survival), path->beta);
    }
    return active;
}
#endif
