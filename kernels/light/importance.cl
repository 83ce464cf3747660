// The importance of a group of lights at a point, an estimate of its unoccluded irradiance, and selection in proportion
// to it.
//
// The bounds of a group are a bounding sphere and a cone of emission normals; emission is within 90 degrees of a
// normal, less for spots. The importance is the irradiance as if all light came from the centre, with both cosines at
// their maximum: 0 only if the group contributes nothing (after Conty Estevez and Kulla 2018, "Importance Sampling of
// Many Lights with Adaptive Tree Splitting", eq. 3). World frame. n: unit, on the lit side of the surface, or 0 if
// light from either side counts.
#include "core/vector.cl"

#define LEAST_IMPORTANCE 1e-30f   // if a group can contribute: less could underflow in sums and quotients

// The largest cosine towards a sphere of radius r; `along` is distance·cos to its centre. It approximates the cosine of
// the angle less the sphere's angular radius: cheaper, 0 for the same spheres, and as good for importance.
static inline real best_cosine(real along, real distance, real r) { return (along + r) / (distance + r); }

// distance·cos of the angle to the nearest direction in a cone; `along` is that to its axis.
static inline real along_cone(real along, real distance, real cos_cone) {
    real turned = along * cos_cone + safe_sqrt((distance * distance - along * along) * (1.0f - cos_cone * cos_cone));
    return along > cos_cone * distance ? distance : turned;
}

#if LIGHT_CONES
// Whether a sphere of radius r is at least partly within an angle, of cosine cos_reach, of the nearest direction;
// `along`: from along_cone.
static inline ireal is_reached(real along, real distance, real r, real cos_reach) {
    real cosine = along / distance, size = r / distance, cos_size = safe_sqrt(1.0f - size * size);
    real nearest = cosine * cos_size + safe_sqrt(1.0f - cosine * cosine) * size;
    return (size >= 1.0f) | (cosine >= cos_size) | (nearest >= cos_reach);
}
#endif

// Whether light from behind the surface counts as well.
static inline ireal is_lit_from_both_sides(real3 n) {
#if TRANSMISSION_LOBES
    return dot3(n, n) == 0.0f;
#else
    return NO_LANES;
#endif
}

// The importance at p of scene->light_groups[group]. Without forced inlining it takes 1.5 times as long.
__attribute__((always_inline)) static inline real importance(const Scene *scene, ireal group, real3 p, real3 n) {
    real3 d = sub(GATHER3(scene->light_groups, group, .center), p), axis = GATHER3(scene->light_groups, group, .axis);
    real r = GATHER(real, scene->light_groups, group, .radius);
    real d2 = maximum(dot3(d, d), (real)(1e-30f)), distance = sqrt(d2);
    real lit = is_lit_from_both_sides(n) ? ONE : best_cosine(dot3(n, d), distance, r);
    real along = along_cone(-dot3(axis, d), distance, GATHER(real, scene->light_groups, group, .cos_cone));
    real shining = best_cosine(along, distance, r);
    real intensity = GATHER(real, scene->light_groups, group, .intensity);
    real irradiance = maximum(intensity * lit * shining / maximum(d2, r * r), (real)(LEAST_IMPORTANCE));
    ireal contributes = (intensity > 0.0f) & (lit > 0.0f) & (shining > 0.0f);
#if LIGHT_CONES
    contributes = contributes & is_reached(along, distance, r, GATHER(real, scene->light_groups, group, .cos_reach));
#endif
    return contributes ? irradiance : ZERO;
}

// The importance of an infinite light, whose irradiance is approximately max(intensity + n·axis, 0).
static inline real infinite_importance(const Scene *scene, ireal group, real3 n) {
    real3 axis = GATHER3(scene->light_groups, group, .axis);
    real directed = is_lit_from_both_sides(n) ? length3(axis) : dot3(n, axis);
    return maximum(GATHER(real, scene->light_groups, group, .intensity) + directed, ZERO);
}

// Turn the importances of n items into probabilities, which add up to 1. The fraction `evenly` is distributed uniformly
// over all items with nonzero importance; if none has any, the first item gets all.
static inline void make_chances(real *chances, int n, float evenly) {
    real total = ZERO, able = ZERO;
    for (int i = 0; i < n; ++i) {
        total += chances[i];
        able += chances[i] > 0.0f ? ONE : ZERO;
    }
    ireal some = total > 1e-37f;    // so that 1/total is finite
    real scale = (1.0f - evenly) / total, share = evenly / able;
    for (int i = 0; i < n; ++i) {
        ireal has = some & (chances[i] > 0.0f);
        chances[i] = has ? chances[i] * scale + share : ZERO;
    }
    chances[0] = some ? chances[0] : ONE;
}

// Sample one of n items by inversion, never one of probability 0; u is rescaled to the position inside the item's
// interval.
static inline ireal draw(const real *chances, int n, real *u, real *probability) {
    ireal drawn = (ireal)(0);
    real below = ZERO, start = ZERO, chance = ONE;
    for (int i = 0; i < n; ++i) {
        ireal here = (chances[i] > 0.0f) & (*u >= below);
        drawn = here ? (ireal)(i) : drawn;
        chance = here ? chances[i] : chance;
        start = here ? below : start;
        below += chances[i];
    }
    *u = minimum((*u - start) / chance, BELOW_ONE);
    *probability = chance;
    return drawn;
}

static inline real chance_of(const real *chances, int n, ireal which) {
    real chance = ZERO;
    for (int i = 0; i < n; ++i) chance = which == i ? chances[i] : chance;
    return chance;
}
