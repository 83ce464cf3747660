// Light groups: each emitter belongs to one, whose light the film stores separately. The host numbers them
// (clrt/rendering/compile/lights/emitter_groups.py).

// The group of each lane's emitter: a light by its number, or the environment as the one after the last. Lanes without an
// emitter get any.
static inline ireal group_of(const Scene *scene, ireal emitter) {
    ireal known = (emitter >= 0) & (emitter <= scene->counts.lights);
    return GATHER(ireal, scene->emitter_groups, known ? emitter : (ireal)(0), .group);
}

// Add light to that of each lane's group.
static inline void add_to_group(real3 *groups, ireal group, real3 light) {
    for (int g = 0; g < GROUPS; ++g) groups[g] = add(groups[g], choose(group == g, light, splat(ZERO)));
}
