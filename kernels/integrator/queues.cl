// Path tracing on GPUs by queues ("Megakernels Considered Harmful", Laine, Karras and Aila 2013): each stage is a kernel
// over all paths of a launch, or over all shadow rays, and the paths that continue are compacted into the queue of the
// next depth. So neighbouring work-items do the same work however paths end, and no kernel needs the registers of all
// stages.
//
// Kernels of a launch, in order: generate; for each depth extend, sort_hits, shade and connect;
// update_film. Queue lengths stay on
// the device. The film is that of the megakernel to the last bit, however the work is cut into launches: a slot has its
// own light, contributions to it are added in the order of the path, and update_film adds the samples of a pixel in
// their order.
#include "integrator/camera_rays.cl"
#include "integrator/queue_records.cl"
#include "film/film.cl"

#define EACH_IN_QUEUE(i, count) for (uint i = get_global_id(0); i < (count); i += get_global_size(0))

// The pixel of a slot; false if it is outside the image.
static inline bool slot_pixel(const Launch *launch, global const uint *tiles, uint slot, LanePixels *pixel) {
    return group_pixels(launch, tiles, slot % launch->pixel_count, pixel);
}

static inline Sampler slot_sampler(const Launch *launch, global const uint *tiles, uint slot, uint dimension) {
    LanePixels pixel;
    slot_pixel(launch, tiles, slot, &pixel);
    Sampler sampler = sampler_at(pixel.code, launch->first_sample + slot / launch->pixel_count, launch->seed,
                                 launch->block_bits);
    sampler.dimension = dimension;
    return sampler;
}

// Set the scene's time to that of a slot, if objects move.
#define SET_SLOT_TIME(scene, launch, tiles, slot) \
    SET_OBJECTS_TIME(scene, launch, slot_sampler(&(launch), tiles, slot, 0), slot_row(&(launch), tiles, slot))

#if MOTION
static inline uint slot_row(const Launch *launch, global const uint *tiles, uint slot) {
    LanePixels pixel;
    slot_pixel(launch, tiles, slot, &pixel);
    return pixel.y;
}
#endif

// Stage 1: generate camera rays.
kernel void generate(SCENE_PARAMETERS, QUEUE_PARAMETERS, global const uint *tiles, const Launch launch) {
    local uint group[2];
    Scene scene = SCENE_ARGUMENTS;
    const Queues q = QUEUE_ARGUMENTS;
    Travel travel;
    travel.slot = (uint)get_global_id(0);
    LanePixels pixel;
    bool seen = travel.slot < launch.pixel_count * launch.sample_count && slot_pixel(&launch, tiles, travel.slot, &pixel);
    if (seen) {
        clear_slot(&q, travel.slot);
        Sampler sampler = slot_sampler(&launch, tiles, travel.slot, 0);
        SET_TIME(scene, launch, sampler, pixel.y)
        CameraRay ray;
        seen = camera_ray(&scene, &launch, pixel.x, pixel.y, next_2d(&sampler), &sampler, &ray);
        travel.path = path_along(ray.origin, ray.direction);
        travel.dimension = sampler.dimension;
        travel.rays = 0;
    }
    uint place = reserve_if(seen, queued_paths(&q, 1), group);
    if (seen) store_path(&q, 1, place, &travel);
}

// Stage 2: intersect the path segments with the scene.
kernel void extend(SCENE_PARAMETERS, QUEUE_PARAMETERS, global const uint *tiles, const Launch launch, const int depth) {
    Scene scene = SCENE_ARGUMENTS;
    CHOOSE_WORLD(scene, launch)
    const Queues q = QUEUE_ARGUMENTS;
    EACH_IN_QUEUE(i, *queued_paths(&q, depth)) {
        global float4 *row = path_rows(&q, depth, i);
        float4 origin = row[0], wi = row[q.capacity];
        SET_SLOT_TIME(scene, launch, tiles, as_uint(origin.w))
#if OPACITY
        Sampler sampler = slot_sampler(&launch, tiles, as_uint(origin.w), as_uint(wi.w));
        Hits hits = first_surface(&scene, xyz(origin), xyz(wi), depth == 1, true, &sampler);
        row[q.capacity].w = as_float(sampler.dimension);
#else
        Hits hits = closest_hit(&scene, xyz(origin), xyz(wi), INFINITY, true);
#endif
        store_hits(&q, i, &hits);
        check_loops(&q, i);
    }
}

// What the stage `shade` makes of a path: its continuation and a shadow ray, if it has them.
typedef struct {
    Travel travel;
    bool goes;
#if SHADOWS
    ShadowRay shadow;
    bool sends;
#endif
} Shaded;

#if PRIMITIVES
// Add emission, sample a light (NEE) and sample the BSDF.
static inline void shade_hit(const Scene *scene, const Queues *q, const Launch *launch, global const uint *tiles,
                             int depth, const Hits *hits, Shaded *shaded) {
    Path *path = &shaded->travel.path;
    Surface surface = surface_at(scene, path->origin, path->wi, hits);
#if CATCHER
    bool caught = depth == 1 && is_catcher(scene, &surface);
    if (caught) q->light[shaded->travel.slot + CAUGHT_ROW * q->capacity] = 1.0f;
    else if (depth == 1 && launch->bare) return;
#endif
    absorb(path, hits->t);
#if ALPHA
    q->light[shaded->travel.slot + ALPHA_ROW * q->capacity] += coverage(path, depth, COVERING(true, caught), false);
#endif
    real3 emitted = add_light(q, launch, shaded->travel.slot, emitted_light(scene, path, &surface, hits->t, true), depth);
#if EMITTER_GROUPS
    add_group_light(q, shaded->travel.slot, group_of(scene, surface.light), emitted);
#endif
    if (depth >= launch->max_depth) return;
#if DISPERSION
    surface.throughput = path->beta;
#endif
    Shading shading = shading_at(scene, path->wi, &surface);
    Sampler sampler = slot_sampler(launch, tiles, shaded->travel.slot, shaded->travel.dimension);
    GUIDING_AT(guiding, scene, surface)
#if SHADOWS
    shaded->sends = aim_at_light(scene, path, &surface, &shading, true, &sampler, &shaded->shadow
                                 GUIDING_ARGUMENT(&guiding));
#endif
    shaded->goes = go_on(scene, path, &surface, &shading, true, depth, launch->max_depth, &sampler
                         GUIDING_ARGUMENT(&guiding));
    shaded->travel.dimension = sampler.dimension;
}
#endif

#include HIT_ORDER

// Stage 4: add environment light for the paths that escape; shade the others.
kernel void shade(SCENE_PARAMETERS, QUEUE_PARAMETERS, global const uint *tiles, const Launch launch, const int depth) {
    local uint group[2];
    Scene scene = SCENE_ARGUMENTS;
    CHOOSE_WORLD(scene, launch)
    const Queues q = QUEUE_ARGUMENTS;
    uint blocks = block_count(&q, depth);
    for (uint block = get_group_id(0); block < blocks; block += get_num_groups(0)) {
        uint i;
        bool used = entry_of(&q, depth, block, &i);
        Shaded shaded;
        shaded.goes = false;
#if SHADOWS
        shaded.sends = false;
#endif
        if (used) {
            Hits hits = load_hits(&q, i);
            shaded.travel = load_path(&q, depth, i);
            ++shaded.travel.rays;
            SET_SLOT_TIME(scene, launch, tiles, shaded.travel.slot)
            if (hits.primitive < 0) {
                Path *path = &shaded.travel.path;
                absorb(path, INFINITY);
#if ALPHA
                q.light[shaded.travel.slot + ALPHA_ROW * q.capacity] += coverage(path, depth, false, true);
#endif
                PARTS(parts)
                real3 escaped = escaped_light(&scene, path, LIT(path, depth, true) CAMERA_ARGUMENT(depth == 1)
                                              PARTS_ARGUMENT(parts));
                add_light(&q, &launch, shaded.travel.slot, escaped, depth);
#if EMITTER_GROUPS
                real factor = clamp_factor(&launch, escaped, depth);
                for (int g = 0; g < GROUPS; ++g) add_group_light(&q, shaded.travel.slot, g, scale(parts[g], factor));
#endif
            }
#if PRIMITIVES
            else shade_hit(&scene, &q, &launch, tiles, depth, &hits, &shaded);
#endif
        }
#if SHADOWS
        uint ray = reserve_if(shaded.sends, queued_shadows(&q, depth), group);
        if (shaded.sends) store_shadow(&q, ray, &shaded.shadow, shaded.travel.slot);
#if MOTION
        if (shaded.sends) *shadow_time(&q, ray) = scene.time;
#endif
        shaded.travel.rays += shaded.sends;
#endif
        if (used && !shaded.goes) q.rays[shaded.travel.slot] = shaded.travel.rays;
        uint place = reserve_if(shaded.goes, queued_paths(&q, depth + 1), group);
        if (shaded.goes) store_path(&q, depth + 1, place, &shaded.travel);
    }
}

#if SHADOWS
// Stage 5: trace the shadow rays and add the light of those that are unoccluded.
kernel void connect(SCENE_PARAMETERS, QUEUE_PARAMETERS, const Launch launch, const int depth) {
    Scene scene = SCENE_ARGUMENTS;
    CHOOSE_WORLD(scene, launch)
    const Queues q = QUEUE_ARGUMENTS;
    EACH_IN_QUEUE(i, *queued_shadows(&q, depth)) {
        uint slot;
        ShadowRay ray = load_shadow(&q, i, &slot);
#if MOTION
        scene.time = *shadow_time(&q, i);
#endif
        real3 direct = add_light(&q, &launch, slot, light_along(&scene, &ray, true), depth + 1);
#if EMITTER_GROUPS
        add_group_light(&q, slot, group_of(&scene, ray.light), direct);
#endif
        check_loops(&q, i);
    }
}
#endif

// Stage 6: add the samples of each pixel in order.
kernel void update_film(QUEUE_PARAMETERS, global Pixel *film, global const uint *tiles, const Launch launch) {
    const Queues q = QUEUE_ARGUMENTS;
    LanePixels own;
    if (!lane_pixels(&launch, tiles, &own) || q.lengths[0]) return;
    Accumulator pixel = load_pixels(film, own.index);
    for (uint s = 0; s < launch.sample_count; ++s) {
        uint slot = s * launch.pixel_count + (uint)get_global_id(0);
#if CATCHER
        if (launch.bare) {
            accumulate_bare(&pixel, slot_light(&q, slot, 0), true);
            pixel.rays += q.rays[slot];
            continue;
        }
#endif
        ireal kept = accumulate(&pixel, slot_light(&q, slot, 0), true);
        pixel.rays += q.rays[slot];
#if DIRECT_LIGHT
        accumulate_direct(&pixel, slot_light(&q, slot, DIRECT_ROW), kept);
#endif
#if CLAMP
        pixel.clamped += kept ? q.light[slot + REMOVED_ROW * q.capacity] : ZERO;
#endif
#if ALPHA
        accumulate_alpha(&pixel, q.light[slot + ALPHA_ROW * q.capacity], kept);
#endif
#if CATCHER
        ireal caught = kept & (q.light[slot + CAUGHT_ROW * q.capacity] > 0.0f);
        accumulate_caught(&pixel, slot_light(&q, slot, 0), caught);
        kept = kept & !caught;
#endif
#if EMITTER_GROUPS
        for (int g = 0; g < GROUPS; ++g) accumulate_group(&pixel, g, slot_light(&q, slot, GROUPS_ROW + 3 * g), kept);
#endif
    }
    store_pixels(film, own.index, true, &pixel);
}
