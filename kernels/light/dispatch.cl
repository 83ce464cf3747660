// The lights of the scene: choice and sampling of a light, and the radiance of emitters that a ray hits.
//
// LIGHT_TYPES lists the types in use, EMITTER_TYPES those with a surface; the host includes their files. Lights are
// numbered by type in that order. If there are several, light/choice.cl chooses one, and every pdf here includes the
// probability of that choice. p, n: the shading point and its unit normal on the lit side.
#include "light/interface.cl"
#include MIS_WEIGHTS
#include LIGHT_FILES
#include LIGHT_CHOICE
#include LIGHT_GROUPS_FILE

#if LIGHTS
// Sample a direction towards each lane's light with u.
static inline LightSample sample_of_light(const Scene *scene, ireal light, real3 p, real2 u) {
    LightSample sample = {splat(ZERO), splat(ZERO), ONE, splat(ZERO), NO_LANES, NO_LANES};
    int first = 0;
#define SAMPLE_LIGHT(name, type) { \
        ireal index = light - first; \
        ireal is_type = (index >= 0) & (index < scene->counts.name##_lights); \
        if (ANY(is_type)) { \
            LightSample s = name##_light_sample(scene, is_type ? index : (ireal)(0), p, u); \
            sample.wi = choose(is_type, s.wi, sample.wi); \
            sample.radiance = choose(is_type, s.radiance, sample.radiance); \
            sample.pdf = is_type ? s.pdf : sample.pdf; \
            sample.target = choose(is_type, s.target, sample.target); \
            sample.infinite = is_type ? s.infinite : sample.infinite; \
            sample.delta = is_type ? s.delta : sample.delta; \
        } \
        first += scene->counts.name##_lights; \
    }
    LIGHT_TYPES(SAMPLE_LIGHT)
    return sample;
}

// Choose a light for each lane, with the probability of the choice; u is left for sampling a point on it.
static inline ireal chosen_light(const Scene *scene, real3 p, real3 n, Sampler *sampler, real2 *u, real *probability) {
    *u = next_2d(sampler);
    return pick_light(scene, p, n, sampler, &u->x, probability);
}

// Choose a light and sample a direction towards it.
static inline LightSample light_sample(const Scene *scene, real3 p, real3 n, Sampler *sampler, ireal *light) {
    real probability;
    real2 u;
    *light = chosen_light(scene, p, n, sampler, &u, &probability);
    LightSample sample = sample_of_light(scene, *light, p, u);
    sample.pdf *= probability;
    return sample;
}
#endif

#if EMITTERS
// Radiance along wi from the emitters hit at distance t, and the pdf with which light_sample would have sampled that
// direction from p.
static inline real3 emitter_radiance(const Scene *scene, real3 p, real3 n, real3 wi, real t, const Surface *surface,
                                     ireal hit, real *pdf) {
    ireal emitter = hit & (surface->light >= 0);
    real3 radiance = splat(ZERO);
    *pdf = ZERO;
    if (!ANY(emitter)) return radiance;
    int first = 0;
#define EMITTED(name, type) { \
        ireal index = surface->light - first; \
        ireal is_type = emitter & (index >= 0) & (index < scene->counts.name##_lights); \
        if (ANY(is_type)) { \
            index = is_type ? index : (ireal)(0); \
            radiance = choose(is_type, name##_light_radiance(scene, index, wi, surface), radiance); \
            *pdf = is_type ? name##_light_pdf(scene, index, p, wi, t, surface) : *pdf; \
        } \
        first += scene->counts.name##_lights; \
    }
    EMITTER_TYPES(EMITTED)
    *pdf *= light_probability(scene, p, n, emitter ? surface->light : (ireal)(0));
    return radiance;
}
#endif

// Whether a ray that escapes can find light: from the sky, or from suns with a size.
#define ENVIRONMENT (SKY || LIGHT_SUN)

#if SKY
// Radiance along wi from the sky, and the pdf with which light_sample would have sampled wi at p.
static inline real3 escaped_radiance(const Scene *scene, real3 p, real3 n, real3 wi, real *pdf) {
    real3 radiance = sky_radiance(scene, wi, pdf);
#if LIGHT_SKY
    *pdf *= light_probability(scene, p, n, (ireal)(scene->counts.lights - 1));   // the sky is the last light
#endif
    return radiance;
}
#endif

// With HIDDEN_SUNS, whether the ray is a camera ray, to which some suns are invisible.
#if HIDDEN_SUNS
#define CAMERA_PARAMETER , int from_camera
#define CAMERA_ARGUMENT(from_camera) , from_camera
#define HIDE_SUN(scene, sun, dark) from_camera && RECORD((scene)->sun_lights, sun)->camera_hidden != 0.0f ? dark :
#else
#define CAMERA_PARAMETER
#define CAMERA_ARGUMENT(from_camera)
#define HIDE_SUN(scene, sun, dark)
#endif

// With light groups, an argument for the part of each of them: an array of zeros.
#if EMITTER_GROUPS
#define PARTS_PARAMETER , real3 *parts
#define PARTS_ARGUMENT(parts) , parts
#define PARTS(parts) real3 parts[GROUPS]; for (int g = 0; g < GROUPS; ++g) parts[g] = splat(ZERO);
#define ADD_PART(scene, emitter, light) add_to_group(parts, (ireal)(RECORD((scene)->emitter_groups, emitter)->group), light);
#else
#define PARTS_PARAMETER
#define PARTS_ARGUMENT(parts)
#define PARTS(parts)
#define ADD_PART(scene, emitter, light)
#endif

#if ENVIRONMENT
// Radiance along wi from the sky and all suns.
static inline real3 environment_radiance(const Scene *scene, real3 wi CAMERA_PARAMETER) {
    real3 radiance = splat(ZERO);
    real pdf;
#if SKY
    radiance = sky_radiance(scene, wi, &pdf);
#endif
#if LIGHT_SUN
    for (int sun = 0; sun < scene->counts.sun_lights; ++sun)
        radiance = HIDE_SUN(scene, sun, radiance) add(radiance, sun_radiance(scene, sun, wi, &pdf));
#endif
    return radiance;
}

// The same at p, with the radiance of each light multiplied by its MIS weight: wi was sampled by the BSDF with
// density `pdf`, or is a specular direction, which light sampling cannot find.
static inline real3 environment_light(const Scene *scene, real3 p, real3 n, real3 wi, real pdf, ireal specular
                                      CAMERA_PARAMETER PARTS_PARAMETER) {
    real3 light = splat(ZERO);
    real other;
#if SKY
    real3 radiance = escaped_radiance(scene, p, n, wi, &other);
    light = scale(radiance, specular ? ONE : bsdf_sample_weight(pdf, other));
    ADD_PART(scene, scene->counts.lights, light)
#endif
#if LIGHT_SUN
    int first = scene->counts.lights - scene->counts.sky_lights - scene->counts.sun_lights;
    for (int sun = 0; sun < scene->counts.sun_lights; ++sun) {
        real3 disc = HIDE_SUN(scene, sun, splat(ZERO)) sun_radiance(scene, sun, wi, &other);
        if (!ANY(other > 0.0f)) continue;
        other *= light_probability(scene, p, n, (ireal)(first + sun));
        disc = scale(disc, specular ? ONE : bsdf_sample_weight(pdf, other));
        ADD_PART(scene, first + sun, disc)
        light = add(light, disc);
    }
#endif
    return light;
}
#endif
