// A path from one of its segments to its end. direct: light from paths of at most two segments; removed: by clamps;
// groups: light by light group, if EMITTER_GROUPS is compiled in.
#include "integrator/path_segment.cl"
#include "traverse/visits.cl"

// The record of a path's vertices, if it is made (guiding/record.cl).
#if !TRAINING
#define RECORD_PARAMETER
#define record_vertex(record, path, surface, L, active, goes)
#endif

// The light that a path brings from its segment `depth` on, 1 being the camera ray.
static inline real3 light_of_path(const Scene *scene, const Launch *launch, Path path, int depth, ireal active,
                                  Sampler *sampler, ureal *rays, real3 *direct, real *removed ALPHA_PARAMETER
                                  CATCHER_PARAMETER GROUPS_PARAMETER RECORD_PARAMETER) {
    real3 L = splat(ZERO);
    for (;; ++depth) {
        *rays += active ? (ureal)(1) : (ureal)(0);
        VISIT(segments, depth);
        Hits hits = first_surface(scene, path.origin, path.wi, depth == 1, active, sampler);
        Surface surface = surface_at(scene, path.origin, path.wi, &hits);
        ireal hit = active & (hits.primitive >= 0);
#if CATCHER
        if (depth == 1) {
            *caught = hit & is_catcher(scene, &surface);
            active = launch->bare ? *caught : active;
            hit = hit & active;
        }
#endif
        absorb(&path, hit ? hits.t : (real)(INFINITY));
        real3 emitted = clamped(launch, emitted_light(scene, &path, &surface, hits.t, hit), depth, removed);
        L = add(L, emitted);
        PARTS(parts)
        real3 escaped = escaped_light(scene, &path, LIT(&path, depth, active & !hit) CAMERA_ARGUMENT(depth == 1)
                                      PARTS_ARGUMENT(parts));
        L = add(L, clamped(launch, escaped, depth, removed));
#if EMITTER_GROUPS
        add_to_group(groups, group_of(scene, surface.light), emitted);
        real factor = clamp_factor(launch, escaped, depth);
        for (int g = 0; g < GROUPS; ++g) groups[g] = add(groups[g], scale(parts[g], factor));
#endif
#if DIRECT_LIGHT
        if (depth <= 2) *direct = L;
#endif
#if ALPHA
        *alpha += coverage(&path, depth, COVERING(hit, *caught), active & !hit);
#endif
        active = hit;
        if (depth >= launch->max_depth || !ANY(active)) return L;
#if PRIMITIVES
#if DISPERSION
        surface.throughput = path.beta;
#endif
        VISIT(shading, surface.material);
        Shading shading = shading_at(scene, path.wi, &surface);
        GUIDING_AT(guiding, scene, surface)
#if LIGHTS
        ShadowRay shadow;
        ireal sent = aim_at_light(scene, &path, &surface, &shading, active, sampler, &shadow
                                  GUIDING_ARGUMENT(&guiding));
        *rays += sent ? (ureal)(1) : (ureal)(0);
        if (ANY(sent)) {
            real3 sampled = clamped(launch, light_along(scene, &shadow, sent), depth + 1, removed);
            L = add(L, sampled);
#if EMITTER_GROUPS
            add_to_group(groups, group_of(scene, shadow.light), sampled);
#endif
        }
#endif
        ireal goes = go_on(scene, &path, &surface, &shading, active, depth, launch->max_depth, sampler
                           GUIDING_ARGUMENT(&guiding));
        record_vertex(record, &path, &surface, L, active, goes);
        active = goes;
#endif
    }
}
