// Which light is sampled: each by its importance at the point, and a part of the choices evenly, since a bright one may be
// hidden. Many of finite extent are represented by groups, and a tree leads on from there.
//
// The first CHOICES of the groups are chosen from. The last INFINITE_LIGHTS of these are infinite lights, whose irradiance
// is about intensity + n·axis.
#include "sampler.cl"
#include "light/importance.cl"
#include LIGHT_TREE_FILE

#define EVENLY 0.2f

static inline void light_chances(const Scene *scene, real3 p, real3 n, real *chances) {
    for (int i = 0; i < CHOICES - INFINITE_LIGHTS; ++i) chances[i] = importance(scene, (ireal)(i), p, n);
    for (int i = CHOICES - INFINITE_LIGHTS; i < CHOICES; ++i) {
        real3 axis = GATHER3(scene->light_groups, (ireal)(i), .axis);
        chances[i] = maximum(GATHER(real, scene->light_groups, (ireal)(i), .intensity) + dot3(n, axis), ZERO);
    }
    make_chances(chances, CHOICES, EVENLY);
}

// A light and the probability of the choice. u makes it and is as good as new afterwards, but for a few digits; the tree,
// which would use up all, draws a number of its own.
static inline ireal pick_light(const Scene *scene, real3 p, real3 n, Sampler *sampler, real *u, real *probability) {
    real chances[CHOICES];
    light_chances(scene, p, n, chances);
    ireal group = draw(chances, CHOICES, u, probability);
#if LIGHT_TREE
    return tree_pick(scene, p, n, group, next_1d(sampler), probability);
#else
    return group;
#endif
}

// That with which pick_light chooses a light.
static inline real light_probability(const Scene *scene, real3 p, real3 n, ireal light) {
    real chances[CHOICES], probability = ONE;
    ireal group = light;
#if LIGHT_TREE
    group = tree_climb(scene, p, n, light, &probability);
#endif
    light_chances(scene, p, n, chances);
    return probability * chance_of(chances, CHOICES, group);
}
