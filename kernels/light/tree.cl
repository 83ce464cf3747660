// Light BVH for many lights: nodes of eight groups, descended by the importance of each group (Conty Estevez and Kulla
// 2018; pbrt, 4th ed., 12.6.3, with two).
//
// The nodes follow the first CHOICES groups. `below`: the first group of the child node of a group, or ~light for a
// leaf. `above`, in the first group of a node: the parent group. The first group of a node is never empty, others may
// be.
#include "light/importance.cl"

#define NODE 8

static inline void node_chances(const Scene *scene, ireal first, real3 p, real3 n, real *chances) {
    for (int i = 0; i < NODE; ++i) chances[i] = importance(scene, first + i, p, n);
    make_chances(chances, NODE, 0.0f);
}

// Sample a light of a group; *probability is multiplied by that of finding it there.
static inline ireal tree_pick(const Scene *scene, real3 p, real3 n, ireal group, real u, real *probability) {
    ireal next = GATHER(ireal, scene->light_groups, group, .below);
    for (ireal open = next >= 0; ANY(open); open = next >= 0) {
        ireal first = open ? next : (ireal)(CHOICES);
        real chances[NODE], chance;
        node_chances(scene, first, p, n, chances);
        ireal drawn = first + draw(chances, NODE, &u, &chance);
        *probability *= open ? chance : ONE;
        next = open ? GATHER(ireal, scene->light_groups, drawn, .below) : next;
    }
    return ~next;
}

// Climb from a light to its group among the first CHOICES; *probability is multiplied by that of finding the light
// there.
static inline ireal tree_climb(const Scene *scene, real3 p, real3 n, ireal light, real *probability) {
    ireal group = GATHER(ireal, scene->light_places, light, .group);
    for (ireal open = group >= CHOICES; ANY(open); open = group >= CHOICES) {
        ireal slot = open ? (group - CHOICES) % NODE : (ireal)(0), first = open ? group - slot : (ireal)(CHOICES);
        real chances[NODE];
        node_chances(scene, first, p, n, chances);
        *probability *= open ? chance_of(chances, NODE, slot) : ONE;
        group = open ? GATHER(ireal, scene->light_groups, first, .above) : group;
    }
    return group;
}
