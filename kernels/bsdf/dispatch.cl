// Dispatch of materials by type. MATERIAL_TYPES lists the types in use and the host includes their files; a scene with
// one material compiles to that material alone.
#include "bsdf/interface.cl"
#include MATERIAL_FILES
#include NORMAL_MAPS_FILE

// The BSDF at each lane's hit: only the member of the lane's material type is meaningful.
typedef struct {
    ireal type;
#define MEMBER(name, number) struct name name;
    MATERIAL_TYPES(MEMBER)
} Bsdf;

// A material's code is type | index << 4, with the index among the materials of its type.
static inline void bsdf_at(const Scene *scene, const Surface *surface, Bsdf *bsdf) {
    bsdf->type = surface->material & 15;
#define READ(name, number) { \
        ireal is_type = bsdf->type == number; \
        if (ANY(is_type)) bsdf->name = name##_at(scene, is_type ? surface->material >> 4 : (ireal)(0), surface); \
    }
    MATERIAL_TYPES(READ)
}

static inline BsdfValue bsdf_eval(const Bsdf *bsdf, real3 wo, real3 wi) {
    BsdfValue value = no_value();
#define EVAL(name, number) { \
        ireal is_type = bsdf->type == number; \
        if (ANY(is_type)) value = choose_value(is_type, name##_eval(&bsdf->name, wo, wi), value); \
    }
    MATERIAL_TYPES(EVAL)
    return value;
}

#if TRANSMISSION
#define SAMPLE_SPREAD(is_type) sample.spread = is_type ? s.spread : sample.spread;
#else
#define SAMPLE_SPREAD(is_type)
#endif
#if HORIZON
#define SAMPLE_MATTE(is_type) sample.matte = choose(is_type, s.matte, sample.matte);
#else
#define SAMPLE_MATTE(is_type)
#endif

static inline BsdfSample bsdf_sample(const Bsdf *bsdf, real3 wo, real2 u, real lobe) {
    BsdfSample sample = no_sample();
#define SAMPLE(name, number) { \
        ireal is_type = bsdf->type == number; \
        if (ANY(is_type)) { \
            BsdfSample s = name##_sample(&bsdf->name, wo, u, lobe); \
            sample.weight = choose(is_type, s.weight, sample.weight); \
            sample.wi = choose(is_type, s.wi, sample.wi); \
            sample.pdf = is_type ? s.pdf : sample.pdf; \
            sample.specular = is_type ? s.specular : sample.specular; \
            SAMPLE_SPREAD(is_type) \
            SAMPLE_MATTE(is_type) \
        } \
    }
    MATERIAL_TYPES(SAMPLE)
    return sample;
}

static inline real3 bsdf_albedo(const Bsdf *bsdf) {
    real3 albedo = splat(ZERO);
#define ALBEDO(name, number) { \
        ireal is_type = bsdf->type == number; \
        if (ANY(is_type)) albedo = choose(is_type, name##_albedo(&bsdf->name), albedo); \
    }
    MATERIAL_TYPES(ALBEDO)
    return albedo;
}

// Whether a direction is on the same side of the geometric normal as of the shading normal, given its cosines with
// both.
static inline ireal same_side(real cos_ns, real cos_ng) {
#if TRANSMISSION
    return ((cos_ns > 0.0f) & (cos_ng > 0.0f)) | ((cos_ns < 0.0f) & (cos_ng < 0.0f));
#else
    return cos_ng > 0.0f;
#endif
}

#if TRANSMISSION_LOBES
// Whether this material, not only its type, scatters light that arrives from behind the surface.
static inline ireal is_lit_from_behind(const Bsdf *bsdf) {
    ireal lit = NO_LANES;
#define SPREADING(name, number) { \
        ireal is_type = bsdf->type == number; \
        if (ANY(is_type)) lit = lit | (is_type & name##_transmits(&bsdf->name)); \
    }
    SPREADING_TYPES(SPREADING)
    return lit;
}
#endif

#include HORIZON_FILE

#if ATTENUATION
// Absorption coefficient beyond the surface, per unit of length; `here` if the material has no inside.
static inline real3 absorption_beyond(const Bsdf *bsdf, real3 here) {
    real3 absorption = here;
#define ABSORBING(name, number) \
    absorption = choose(bsdf->type == number, name##_absorption(&bsdf->name, here), absorption);
    ABSORBING_TYPES(ABSORBING)
    return absorption;
}

// Transmittance over a distance (Beer–Lambert law); 1 without absorption, even for an infinite distance.
static inline real3 attenuated(real3 absorption, real distance) {
    return vector(absorption.x > 0.0f ? exp(-absorption.x * distance) : ONE,
                  absorption.y > 0.0f ? exp(-absorption.y * distance) : ONE,
                  absorption.z > 0.0f ? exp(-absorption.z * distance) : ONE);
}
#endif
