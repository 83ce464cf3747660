// Light selection: lights are chosen by their importance at the shading point, with a uniform fraction because a bright
// light may be occluded. Many lights of finite extent are represented by groups, the roots of a light BVH.
//
// Invariant: the probability of a light is 0 only if the light contributes nothing. Delta lights are found by light
// sampling alone, so a probability of 0 anywhere else would silently lose their light.
//
// The choice is among the first CHOICES groups, the last INFINITE_LIGHTS of which are infinite lights.
#include "sampler/interface.cl"
#include "light/importance.cl"
#include LIGHT_TREE_FILE

#define EVENLY 0.2f

static inline void light_chances(const Scene *scene, real3 p, real3 n, real *chances) {
    for (int i = 0; i < CHOICES - INFINITE_LIGHTS; ++i) chances[i] = importance(scene, (ireal)(i), p, n);
    for (int i = CHOICES - INFINITE_LIGHTS; i < CHOICES; ++i) chances[i] = infinite_importance(scene, (ireal)(i), n);
    make_chances(chances, CHOICES, EVENLY);
}

// Choose a light and return the probability of the choice. u is consumed and rescaled for reuse, losing a few digits;
// the light BVH, which would use up all of u, draws a number of its own.
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

// The probability with which pick_light chooses a light.
static inline real light_probability(const Scene *scene, real3 p, real3 n, ireal light) {
    real chances[CHOICES], probability = ONE;
    ireal group = light;
#if LIGHT_TREE
    group = tree_climb(scene, p, n, light, &probability);
#endif
    light_chances(scene, p, n, chances);
    return probability * chance_of(chances, CHOICES, group);
}
