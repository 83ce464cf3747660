// The same radiance from every direction. A ray that escapes brings it; it is not sampled as a light, since directions
// chosen by the surface are never worse for it.
#include "light/interface.cl"

static inline real3 sky_radiance(const Scene *scene, real3 wi, real *pdf) {
    *pdf = ZERO;
    return (real3){(real)(scene->environment->color[0]), (real)(scene->environment->color[1]),
                   (real)(scene->environment->color[2])};
}
