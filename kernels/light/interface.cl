// What every light's file provides, by its name:
//
//   NAME_light_sample(scene, index, p, u, bits)        a direction from p towards the light
//   NAME_light_pdf(scene, index, p, wi, t, surface)    density per solid angle with which it chooses wi (0 for points
//                                                      and directions, which no ray meets by chance)
//   NAME_light_radiance(scene, index, wi, surface)     what arrives along wi from the surface that the ray met
//
// The sky is met by missing everything: sky_radiance(scene, wi, &pdf) gives what arrives, and that density.
//
// World frame; wi: unit, from p to the light; u in [0,1)², bits random.
// They draw no random numbers themselves: a lane's numbers must not depend on what its neighbours chose.
#include "surface.cl"
#include "sampling.cl"
#include "rng.cl"

typedef struct {
    real3 wi;
    real3 radiance;     // arrives along wi if nothing is in between; the irradiance across wi where `delta`
    real pdf;           // per solid angle; 1 where `delta`
    real3 target;       // where the shadow ray ends, just before the light; meaningless where `infinite`
    ireal infinite, delta;
} LightSample;

// A point q of a light's surface, moved towards p beyond the rounding of a ray between the two.
static inline real3 shadow_target(real3 p, real3 q, real3 n) {
    real distance = dot3(absolute3(n), scale(add(absolute3(p), absolute3(q)), (real)(GAMMA(16))));
    return mad3(n, dot3(sub(p, q), n) < 0.0f ? -distance : distance, q);
}

// Alias method (Walker 1977): one of n entries with the probabilities that the host built the table for.
#define ALIAS_PICK(table, n, bits, picked) \
    ureal slot_ = mul_hi(bits.x, (ureal)(uint)(n)); \
    ireal picked = AS_INT(slot_); \
    picked = unit_interval(bits.y) < GATHER(real, table, picked, .threshold) ? picked : GATHER(ireal, table, picked, .alias);
