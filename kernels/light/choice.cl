// Light sampling: each light is chosen by its importance at the point, and a part of the choices is uniform, because a
// bright light may be occluded. Many lights of finite extent are represented by groups, from which a light BVH leads on.
//
// The rule: the probability of a light is 0 only where the light contributes nothing. Delta lights are found by light
// sampling alone, so a probability of 0 anywhere else would lose them without a trace.
//
// The first CHOICES of the groups are chosen from. The last INFINITE_LIGHTS of these are infinite lights.
#include "sampler.cl"
#include "light/importance.cl"
#include LIGHT_TREE_FILE

#define EVENLY 0.2f

static inline void light_chances(const Scene *scene, real3 p, real3 n, real *chances) {
    for (int i = 0; i < CHOICES - INFINITE_LIGHTS; ++i) chances[i] = importance(scene, (ireal)(i), p, n);
    for (int i = CHOICES - INFINITE_LIGHTS; i < CHOICES; ++i) chances[i] = infinite_importance(scene, (ireal)(i), n);
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
