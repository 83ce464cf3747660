// Record the paths of one pixel's samples vertex by vertex: the same paths as integrator/path.cl, by the same stages
// of integrator/path_segment.cl, so the recorded contributions add up to the samples of the render.
//
// Each lane follows one sample, `sample_count` of them from first_sample on, through the pixel first_pixel, with room
// for max_depth records. VERTEX_ROWS, VERTEX_REALS and VERTEX_INTS list the members of a record by type, and END_…
// why a path ended; the host writes both (clrt/debug/record.py). Random choices that a stage does not return are
// drawn again from a copy of its sampler. World frame.
#include "integrator/camera_rays.cl"
#include "integrator/path_segment.cl"
#include "film/film.cl"

typedef struct {
#define ROW_MEMBER(name) real3 name;
#define REAL_MEMBER(name) real name;
#define INT_MEMBER(name) ireal name;
    VERTEX_ROWS(ROW_MEMBER)
    VERTEX_REALS(REAL_MEMBER)
    VERTEX_INTS(INT_MEMBER)
} VertexLanes;

static inline VertexLanes blank_vertex(void) {
    VertexLanes v;
#define BLANK_ROW(name) v.name = splat(ZERO);
#define BLANK_REAL(name) v.name = ZERO;
#define BLANK_INT(name) v.name = (ireal)(0);
    VERTEX_ROWS(BLANK_ROW)
    VERTEX_REALS(BLANK_REAL)
    VERTEX_INTS(BLANK_INT)
    v.primitive = v.emitter = v.light = v.blocker = (ireal)(-1);
    v.emission_clamp = v.direct_clamp = ONE;
    return v;
}

static inline void store_vertex(global Vertex *to, const VertexLanes *v, int lane) {
#define STORE_ROW(name) store_rows(to->name, &v->name, lane);
#define STORE_REAL(name) to->name = LANE(v->name, lane);
#define STORE_INT(name) to->name = LANE_INT(v->name, lane);
    VERTEX_ROWS(STORE_ROW)
    VERTEX_REALS(STORE_REAL)
    VERTEX_INTS(STORE_INT)
}

static inline ireal flag(ireal mask) { return mask ? (ireal)(1) : (ireal)(0); }

// Record the path vertex and the emission found there.
static inline void note_arrival(const Scene *scene, const Path *path, const Surface *surface, const Hits *hits, ireal hit,
                                ireal escaped, int depth, VertexLanes *v) {
    v->throughput = at_eye(path, splat(ONE));
    v->distance = hits->t;
    v->primitive = hit ? hits->primitive : (ireal)(-1);
    v->instance = hit ? hits->instance : (ireal)(0);
    PARTS(parts)
    v->emission = add(emitted_light(scene, path, surface, hits->t, hit),
                      escaped_light(scene, path, LIT(path, depth, escaped) CAMERA_ARGUMENT(depth == 1)
                                    PARTS_ARGUMENT(parts)));
#if EMITTERS
    real pdf;
    v->emitter = hit ? surface->light : (ireal)(-1);
    v->radiance = choose(hit, emitter_radiance(scene, path->p, path->n, path->wi, hits->t, surface, hit, &pdf), splat(ZERO));
#endif
#if ENVIRONMENT
    if (ANY(escaped)) {
        real3 wi = choose(escaped, path->wi, vector(ZERO, ONE, ZERO));
        v->radiance = choose(escaped, environment_radiance(scene, wi CAMERA_ARGUMENT(depth == 1)), v->radiance);
    }
#endif
}

#if PRIMITIVES
#if LIGHTS
// Return the hit that blocks a shadow ray: the first opaque surface along it.
static inline Hits blocker_of(const Scene *scene, const ShadowRay *ray, ireal stopped) {
    real3 direction = choose(ray->infinite, ray->wi, sub(ray->target, ray->origin));
    real t_max = ray->infinite ? (real)(INFINITY) : ONE;
    Hits hits = closest_hit(scene, ray->origin, direction, t_max, stopped);
#if OPACITY
    for (;;) {
        Surface surface = surface_at(scene, ray->origin, direction, &hits);
        ireal passes = stopped & (hits.primitive >= 0) & (opacity_at(scene, &surface, direction, false) < 1.0f);
        if (!ANY(passes)) break;
        Hits next = next_hit(scene, ray->origin, direction, t_max, passes, &hits, SEARCH_CLOSEST);
        hits = choose_hits(passes, &next, &hits);
    }
#endif
    return hits;
}

// Record the sampled light and its contribution.
static inline void note_light(const Scene *scene, const Path *path, const Surface *surface, const Shading *shading,
                              ireal active, Sampler *sampler, VertexLanes *v GUIDING_PARAMETER) {
    Sampler again = *sampler;
    real3 n = choosing_normal(shading);
    real2 u;
    real probability;
    ireal light = chosen_light(scene, surface->p, n, &again, &u, &probability);
    LightSample sample = sample_of_light(scene, light, surface->p, u);
    BsdfValue bsdf = shading_eval(shading, surface, sample.wi);
    real pdf = sample.pdf * probability, bsdf_pdf = guided_pdf(scene, guiding, sample.wi, bsdf.pdf);
    v->light = active ? light : (ireal)(-1);
    v->light_probability = active ? probability : ZERO;
    v->light_direction = choose(active, sample.wi, splat(ZERO));
    v->light_radiance = choose(active, sample.radiance, splat(ZERO));
    v->light_bsdf = choose(active, bsdf.value, splat(ZERO));
    v->light_pdf = active ? pdf : ZERO;
    v->light_weight = (active & !sample.delta) ? light_sample_weight(pdf, bsdf_pdf) : ONE;

    ShadowRay shadow;
    ireal sent = aim_at_light(scene, path, surface, shading, active, sampler, &shadow GUIDING_ARGUMENT(guiding));
    v->sent = flag(sent);
    if (!ANY(sent)) return;
    v->unshadowed = choose(sent, shadow.contribution, splat(ZERO));
    v->direct = light_along(scene, &shadow, sent);
    ireal stopped = sent & carries_light(v->unshadowed) & !carries_light(v->direct);
    if (!ANY(stopped)) return;
    Hits blocker = blocker_of(scene, &shadow, stopped);
    v->blocker = stopped ? blocker.primitive : (ireal)(-1);
    v->blocker_instance = stopped ? blocker.instance : (ireal)(0);
}
#endif

// Record the sampled direction of the next segment, or why the path ends here.
static inline ireal note_direction(const Scene *scene, Path *path, const Surface *surface, const Shading *shading,
                                   ireal active, int depth, int max_depth, Sampler *sampler,
                                   VertexLanes *v GUIDING_PARAMETER) {
    Sampler again = *sampler;
    ireal goes = go_on(scene, path, surface, shading, active, depth, max_depth, sampler GUIDING_ARGUMENT(guiding));
    v->end = goes ? (ireal)(END_NONE) : (ireal)(END_DEPTH);
    if (sampler->dimension == again.dimension) return goes;   // last vertex: no direction was sampled
    real2 u = next_2d(&again), choice = next_2d(&again);
#if GUIDING
    real bsdf_pdf;
#endif
    BsdfSample sample = guided_sample(scene, guiding, shading, surface, u, choice.x, &bsdf_pdf);
    v->direction = choose(active, sample.wi, splat(ZERO));
    v->weight = choose(active, sample.weight, splat(ZERO));
    v->pdf = active ? sample.pdf : ZERO;
    v->specular = flag(active & sample.specular);
    ireal why = !(sample.pdf > 0.0f) ? (ireal)(END_SIDE) : (ireal)(END_ROULETTE);
    why = !carries_light(sample.weight) ? (ireal)(END_ABSORBED) : why;
    v->end = goes ? (ireal)(END_NONE) : why;
    return goes;
}
#endif

__attribute__((vec_type_hint(real)))
kernel void debug(SCENE_PARAMETERS, global Vertex *vertices, const Launch launch) {
    Scene scene = SCENE_ARGUMENTS;
    uint first = (uint)get_global_id(0) * LANES;
    if (first >= launch.sample_count) return;
    ureal number = (ureal)(first) + LANE_INDEX;
    ireal arrived = number < launch.sample_count;
    ureal x = (ureal)(launch.first_pixel % launch.width), y = (ureal)(launch.first_pixel / launch.width);
    Sampler sampler = sampler_at(pixel_code(x, y), launch.first_sample + number, launch.seed, launch.block_bits);
    SET_TIME(scene, launch, sampler, y)
    CameraRay ray;   // a sample without one escapes at once
    ireal active = arrived & camera_ray(&scene, &launch, x, y, next_2d(&sampler), &sampler, &ray);
    Path path = path_along(ray.origin, ray.direction);
    for (int depth = 1; ANY(arrived); ++depth) {
        VertexLanes v = blank_vertex();
        Hits hits = first_surface(&scene, path.origin, path.wi, depth == 1, active, &sampler);
        Surface surface = surface_at(&scene, path.origin, path.wi, &hits);
        ireal hit = active & (hits.primitive >= 0);
        absorb(&path, hit ? hits.t : (real)(INFINITY));
        note_arrival(&scene, &path, &surface, &hits, hit, active & !hit, depth, &v);
        v.emission_clamp = clamp_factor(&launch, v.emission, depth);
        v.end = hit ? (ireal)(END_DEPTH) : (ireal)(END_ESCAPED);
        active = NO_LANES;
#if PRIMITIVES
#if DISPERSION
        surface.throughput = path.beta;
#endif
        Shading shading = shading_at(&scene, path.wi, &surface);
        v.position = choose(hit, surface.p, splat(ZERO));
        v.geometric_normal = choose(hit, surface.ng, splat(ZERO));
        v.shading_normal = choose(hit, surface.ns, splat(ZERO));
        v.front = flag(hit & surface.front);
        if (depth < launch.max_depth && ANY(hit)) {
            GUIDING_AT(guiding, &scene, surface)
#if LIGHTS
            note_light(&scene, &path, &surface, &shading, hit, &sampler, &v GUIDING_ARGUMENT(&guiding));
            v.direct_clamp = clamp_factor(&launch, v.direct, depth + 1);
#endif
            active = note_direction(&scene, &path, &surface, &shading, hit, depth, launch.max_depth, &sampler, &v
                                    GUIDING_ARGUMENT(&guiding));
            v.end = hit ? v.end : (ireal)(END_ESCAPED);
        }
#endif
        for (int lane = 0; lane < LANES; ++lane)
            if (LANE_INT(arrived, lane))
                store_vertex(vertices + (first + lane) * launch.max_depth + depth - 1, &v, lane);
        arrived = active;
    }
    if (!loops_ended(launch.width)) return;
    for (uint lane = 0; lane < LANES && first + lane < launch.sample_count; ++lane)
        vertices[(first + lane) * launch.max_depth].end = END_LOOPS;
}
