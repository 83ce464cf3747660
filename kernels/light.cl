// The lights of the scene: one table of all that can be sampled, and by type what shines when a ray meets it.
//
// LIGHT_TYPES lists the types in use, EMITTER_TYPES those that have a surface; the host includes their files. A light
// is chosen from the table with `probability`, which is part of every pdf here.
#include "light/interface.cl"
#include LIGHT_FILES

#if LIGHTS
static inline ireal light_index(ireal code, ireal is_type) { return is_type ? code >> 4 : (ireal)(0); }

static inline LightSample light_sample(const Scene *scene, real3 p, Sampler *sampler) {
    ureal2 choice = next_bits(sampler), bits = next_bits(sampler);
    real2 u = next_2d(sampler);
    ALIAS_PICK(scene->lights, scene->counts.lights, choice, entry)
    ireal code = GATHER(ireal, scene->lights, entry, .code);
    real probability = GATHER(real, scene->lights, entry, .probability);
    LightSample sample = {splat(ZERO), splat(ZERO), ONE, splat(ZERO), NO_LANES, NO_LANES};
#define SAMPLE_LIGHT(name, type) { \
        ireal is_type = (code & 15) == type; \
        if (ANY(is_type)) { \
            LightSample s = name##_light_sample(scene, light_index(code, is_type), p, u, bits); \
            sample.wi = choose(is_type, s.wi, sample.wi); \
            sample.radiance = choose(is_type, s.radiance, sample.radiance); \
            sample.pdf = is_type ? s.pdf : sample.pdf; \
            sample.target = choose(is_type, s.target, sample.target); \
            sample.infinite = is_type ? s.infinite : sample.infinite; \
            sample.delta = is_type ? s.delta : sample.delta; \
        } \
    }
    LIGHT_TYPES(SAMPLE_LIGHT)
    sample.pdf *= probability;
    return sample;
}
#endif

#if EMITTERS
// Radiance that arrives along wi from the emitters that lanes met at distance t, and the density with which
// light_sample would have chosen that direction from p.
static inline real3 emitter_radiance(const Scene *scene, real3 p, real3 wi, real t, const Surface *surface, ireal hit,
                                     real *pdf) {
    ireal emitter = hit & (surface->light >= 0);
    real3 radiance = splat(ZERO);
    *pdf = ZERO;
    if (!ANY(emitter)) return radiance;
    ireal entry = emitter ? surface->light : (ireal)(0);
    ireal code = GATHER(ireal, scene->lights, entry, .code);
#define EMITTED(name, type) { \
        ireal is_type = emitter & ((code & 15) == type); \
        if (ANY(is_type)) { \
            ireal index = light_index(code, is_type); \
            radiance = choose(is_type, name##_light_radiance(scene, index, wi, surface), radiance); \
            *pdf = is_type ? name##_light_pdf(scene, index, p, wi, t, surface) : *pdf; \
        } \
    }
    EMITTER_TYPES(EMITTED)
    *pdf *= GATHER(real, scene->lights, entry, .probability);
    return radiance;
}
#endif
