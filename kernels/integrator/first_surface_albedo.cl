// Albedo: the fraction of white light reflected or transmitted at normal incidence.
#include "bsdf/dispatch.cl"

static inline real3 picture_value(const Scene *scene, const Launch *launch, real3 direction, real t,
                                  Surface *surface) {
    turn_towards(surface, negate(direction));
    Bsdf bsdf;
    bsdf_at(scene, surface, &bsdf);
    return bsdf_albedo(&bsdf);
}
