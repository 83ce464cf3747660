// Directions of paths from BSDF and guiding field: one of both is chosen at random, and the density is that of the
// mixture, as a MIS estimator of one sample (Veach 1997, 9.2.4).
#include "guiding/field.cl"
#include "surface/shading.cl"

#define GUIDING_PARAMETER , const Guiding *guiding
#define GUIDING_ARGUMENT(guiding) , guiding
#define GUIDING_AT(guiding, scene, surface) Guiding guiding = guiding_at(scene, (surface).p, (surface).ns);

// The density of a direction of the BSDF's density bsdf_pdf.
static inline real guided_pdf(const Scene *scene, const Guiding *guiding, real3 wi, real bsdf_pdf) {
    if (!ANY(guiding->share > 0.0f)) return bsdf_pdf;
    return bsdf_pdf + guiding->share * (guiding_pdf(scene, guiding, wi) - bsdf_pdf);
}

// Sample BSDF or field, as `choice` says, which is uniform in [0, 1). Specular directions are the BSDF's alone.
// *bsdf_pdf is set to the BSDF's density of the direction.
static inline BsdfSample guided_sample(const Scene *scene, const Guiding *guiding, const Shading *shading,
                                       const Surface *surface, real2 u, real choice, real *bsdf_pdf) {
    real share = guiding->share;
    ireal guided = choice < share;
    real lobe = guided ? choice / share : (choice - share) / (1.0f - share);
    BsdfSample sample = shading_sample(shading, surface, u, minimum(lobe, BELOW_ONE));
    *bsdf_pdf = sample.pdf;
    ireal mixed = (share > 0.0f) & !sample.specular;
    if (!ANY(mixed)) return sample;
    guided = guided & mixed;
    real density;
    real3 wi = choose(guided, guiding_sample(scene, guiding, u, &density), sample.wi);
    BsdfValue at = shading_eval(shading, surface, wi);
    density = guided ? density : guiding_pdf(scene, guiding, wi);
    real pdf = guided ? at.pdf : sample.pdf, mixture = pdf + share * (density - pdf);
    real3 weight = choose(guided, scale(at.value, 1.0f / mixture), scale(sample.weight, sample.pdf / mixture));
    ireal found = guided | (sample.pdf > 0.0f);
    sample.wi = wi;
    sample.weight = choose(mixed & found, weight, sample.weight);
    sample.pdf = mixed & found ? mixture : sample.pdf;
#if TRANSMISSION
    sample.spread = guided ? ONE : sample.spread;   // part of the value
#endif
    *bsdf_pdf = mixed ? pdf : *bsdf_pdf;
    return sample;
}
