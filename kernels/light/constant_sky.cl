// A sky of constant radiance, seen by rays that escape. It is not sampled as a light, since BSDF sampling is never
// worse for it.
#include "light/interface.cl"

static inline real3 sky_radiance(const Scene *scene, real3 wi, real *pdf) {
    *pdf = ZERO;
    return (real3){(real)(RECORD(scene->environment, 0)->color[0]), (real)(RECORD(scene->environment, 0)->color[1]),
                   (real)(RECORD(scene->environment, 0)->color[2])};
}
