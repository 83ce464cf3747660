// Wavefront path tracing: a work-item traces all paths of a tile together, WAVE_SAMPLES samples per pixel at a time,
// one segment per iteration.
//
// Each stage runs for all paths before the next stage begins, and the paths that continue are compacted, so that SIMD
// lanes stay full however paths end. Short loops with a single job also run faster on a CPU than one large loop.
#include "integrator/camera_rays.cl"
#include "integrator/path_segment.cl"
#include "film/film.cl"
#include "integrator/compaction.cl"

#define WAVE_SAMPLES 4
#define TILE_PIXELS (TILE * TILE)
#define WAVE (TILE_PIXELS * WAVE_SAMPLES)
#define SHADOWS (PRIMITIVES && LIGHTS)
#define ROW (WAVE + LANES)   // compaction may write LANES past the end; powers of two cause cache conflicts

// Path state between stages. slot: the index of the sample in the wave, pixels within samples (slot % TILE_PIXELS is
// the pixel).
typedef struct {
    Path path;
    ureal slot;
} Travel;

typedef struct { Travel travel; Hits hits; } Arrival;

#if SHADOWS
typedef struct { ShadowRay ray; ureal slot; } Shadow;
#endif

// State of a wave: about 70 KiB of private memory, as structure of arrays.
typedef struct {
    int arrivals[WORDS(Arrival)][ROW];   // holds Travel at first; the rows of Hits are appended by `trace`
    int escapes[WORDS(Travel)][ROW];
#if SHADOWS
    int shadows[WORDS(Shadow)][ROW];
#endif
    float light[3][WAVE];                // radiance by slot
#if DIRECT_LIGHT
    float direct[3][WAVE];               // the part from paths of at most two segments
#endif
#if CLAMP
    float removed[WAVE];                 // energy removed by clamping
#endif
#if ALPHA
    float alpha[WAVE];                   // coverage
#endif
#if CATCHER
    float caught[WAVE];                  // 1 where the camera sees a catcher
#endif
#if EMITTER_GROUPS
    float groups[3 * GROUPS][WAVE];      // radiance by light group
#endif
    const Launch *launch;
    uint x, y, sample;                   // of slot 0
    uint dimension, rays;
} Wave;

static inline ureal slot_x(const Wave *w, ureal slot) { return w->x + slot % TILE; }
static inline ureal slot_y(const Wave *w, ureal slot) { return w->y + slot / TILE % TILE; }
static inline ireal in_picture(const Wave *w, ureal slot) {
    return (slot_x(w, slot) < w->launch->width) & (slot_y(w, slot) < w->launch->height);
}

static inline Sampler slot_sampler(const Wave *w, ureal slot) {
    Sampler sampler = sampler_at(pixel_code(slot_x(w, slot), slot_y(w, slot)), w->sample + slot / TILE_PIXELS,
                                 w->launch->seed, w->launch->block_bits);
    sampler.dimension = w->dimension;
    return sampler;
}

// Add the contributions of paths of `edges` segments to their slots. Returns what it added.
static inline real3 add_light(Wave *w, ureal slot, real3 found, int edges) {
    real removed = ZERO;
    real3 light = clamped(w->launch, found, edges, &removed);
    ireal some = (light.x != 0.0f) | (light.y != 0.0f) | (light.z != 0.0f);   // true for NaN too, which the film drops
    for (uint bits = mask_bits(some); bits; bits &= bits - 1) {
        int lane = first_bit(bits);
        uint to = LANE_UINT(slot, lane);
        w->light[0][to] += LANE(light.x, lane);
        w->light[1][to] += LANE(light.y, lane);
        w->light[2][to] += LANE(light.z, lane);
#if CLAMP
        w->removed[to] += LANE(removed, lane);
#endif
    }
    return light;
}

#if EMITTER_GROUPS
// Add light to that of each lane's light group.
static inline void add_group_light(Wave *w, ureal slot, ireal group, real3 light) {
    ireal some = (light.x != 0.0f) | (light.y != 0.0f) | (light.z != 0.0f);
    for (uint bits = mask_bits(some); bits; bits &= bits - 1) {
        int lane = first_bit(bits), row = 3 * LANE_INT(group, lane);
        uint to = LANE_UINT(slot, lane);
        w->groups[row][to] += LANE(light.x, lane);
        w->groups[row + 1][to] += LANE(light.y, lane);
        w->groups[row + 2][to] += LANE(light.z, lane);
    }
}
#endif

#if ALPHA
// Add values of some lanes to those of their slots.
static inline void add_to_slots(float *row, ureal slot, real found, ireal some) {
    for (uint bits = mask_bits(some); bits; bits &= bits - 1) {
        int lane = first_bit(bits);
        row[LANE_UINT(slot, lane)] += LANE(found, lane);
    }
}
#endif

// Set the scene's time to that of slots, if the camera or objects move.
#define SET_SLOT_TIME(w, slot) SET_TIME(*scene, *w->launch, slot_sampler(w, slot), slot_y(w, slot))
#define SET_SLOT_OBJECTS_TIME(w, slot) SET_OBJECTS_TIME(*scene, *w->launch, slot_sampler(w, slot), slot_y(w, slot))

// Stage 1: generate camera rays. Each stage returns the number of paths, or shadow rays, for the next one.
__attribute__((noinline)) static int set_out(Scene *scene, Wave *w, int slots) {
    int count = 0;
    uint dimension = 0;
    w->dimension = 0;
    for (int i = 0; i < slots; i += LANES) {
        Travel travel;
        travel.slot = (uint)i + LANE_INDEX;
        Sampler sampler = slot_sampler(w, travel.slot);
        SET_SLOT_TIME(w, travel.slot)
        CameraRay ray;
        ireal seen = in_picture(w, travel.slot) & camera_ray(scene, w->launch, slot_x(w, travel.slot),
                                                             slot_y(w, travel.slot), next_2d(&sampler), &sampler, &ray);
        travel.path = path_along(ray.origin, ray.direction);
        PACK(travel, seen, w->arrivals, count)
        for (int c = 0; c < 3; ++c) vstore8(ZERO, 0, w->light[c] + i);
#if DIRECT_LIGHT
        for (int c = 0; c < 3; ++c) vstore8(ZERO, 0, w->direct[c] + i);   // the tile may have no camera rays at all
#endif
#if CLAMP
        vstore8(ZERO, 0, w->removed + i);
#endif
#if ALPHA
        vstore8(ZERO, 0, w->alpha + i);
#endif
#if CATCHER
        vstore8(ZERO, 0, w->caught + i);
#endif
#if EMITTER_GROUPS
        for (int row = 0; row < 3 * GROUPS; ++row) vstore8(ZERO, 0, w->groups[row] + i);
#endif
        dimension = sampler.dimension;
    }
    FILL_UP(Travel, w->arrivals, count)
    w->dimension = dimension;
    return count;
}

// Stage 2: intersect the path segments with the scene.
__attribute__((noinline)) static void trace(Scene *scene, Wave *w, int count, int depth) {
    uint dimension = w->dimension;
    for (int i = 0; i < count; i += LANES) {
        Travel travel;
        LOAD(travel, w->arrivals, i)
        SET_SLOT_OBJECTS_TIME(w, travel.slot)
#if OPACITY
        Sampler sampler = slot_sampler(w, travel.slot);
        Hits hits = first_surface(scene, travel.path.origin, travel.path.wi, depth == 1, lanes_of(i, count), &sampler);
        dimension = sampler.dimension;
#else
        Hits hits = closest_hit(scene, travel.path.origin, travel.path.wi, (real)(INFINITY), lanes_of(i, count));
#endif
        STORE(hits, w->arrivals + WORDS(travel), i)
    }
    w->dimension = dimension;
    w->rays += count;
}

// Stage 3: compact the paths that hit a surface; add environment light for those that escape.
__attribute__((noinline)) static int sort_out(const Scene *scene, Wave *w, int count, int depth) {
    int arrived = 0, escaped = 0;
    for (int i = 0; i < count; i += LANES) {
        Arrival a;
        LOAD(a, w->arrivals, i)
        ireal active = lanes_of(i, count), hit = active & (a.hits.primitive >= 0), missed = active & !hit;
#if ENVIRONMENT || CLEAR_GLASS
        if (ANY(missed)) PACK(a.travel, missed, w->escapes, escaped)
#endif
        if (ANY(missed) || arrived < i) PACK(a, hit, w->arrivals, arrived)
        else arrived += (int)popcount(mask_bits(hit));
    }
    FILL_UP(Travel, w->escapes, escaped)
    for (int i = 0; i < escaped; i += LANES) {
        Travel travel;
        LOAD(travel, w->escapes, i)
        absorb(&travel.path, (real)(INFINITY));
        PARTS(parts)
        real3 light = escaped_light(scene, &travel.path, LIT(&travel.path, depth, lanes_of(i, escaped))
                                    CAMERA_ARGUMENT(depth == 1) PARTS_ARGUMENT(parts));
        add_light(w, travel.slot, light, depth);
#if EMITTER_GROUPS
        real factor = clamp_factor(w->launch, light, depth);
        for (int g = 0; g < GROUPS; ++g) add_group_light(w, travel.slot, (ireal)(g), scale(parts[g], factor));
#endif
#if CLEAR_GLASS
        ireal passed = lanes_of(i, escaped);
        if (depth > 1) add_to_slots(w->alpha, travel.slot, coverage(&travel.path, depth, !passed, passed), passed);
#endif
    }
    return arrived;
}

#if PRIMITIVES
// Stage 4: at each hit add emission, sample a light (NEE) and sample the BSDF. *sent: the number of shadow rays.
__attribute__((noinline)) static int shade(Scene *scene, Wave *w, int count, int depth, int *sent) {
    int going = 0;
    uint dimension = w->dimension;
    *sent = 0;
    for (int i = 0; i < count; i += LANES) {
        Arrival a;
        LOAD(a, w->arrivals, i)
        Path *path = &a.travel.path;
        ireal active = lanes_of(i, count);
        a.hits.primitive = active ? a.hits.primitive : (ireal)(-1);
        SET_SLOT_OBJECTS_TIME(w, a.travel.slot)
        Surface surface = surface_at(scene, path->origin, path->wi, &a.hits);
#if CATCHER
        if (depth == 1) {
            ireal caught = active & is_catcher(scene, &surface);
            add_to_slots(w->caught, a.travel.slot, ONE, caught);
            active = scene->bare ? caught : active;
            add_to_slots(w->alpha, a.travel.slot, ONE, active & !caught);
        }
#elif ALPHA
        if (depth == 1) add_to_slots(w->alpha, a.travel.slot, ONE, active);
#endif
        absorb(path, a.hits.t);
        real3 emitted = add_light(w, a.travel.slot, emitted_light(scene, path, &surface, a.hits.t, active), depth);
#if EMITTER_GROUPS
        add_group_light(w, a.travel.slot, group_of(scene, surface.light), emitted);
#endif
        if (depth >= w->launch->max_depth) continue;
#if DISPERSION
        surface.throughput = path->beta;
#endif
        Shading shading = shading_at(scene, path->wi, &surface);
        Sampler sampler = slot_sampler(w, a.travel.slot);
        GUIDING_AT(guiding, scene, surface)
#if SHADOWS
        Shadow shadow;
        shadow.slot = a.travel.slot;
        ireal sends = aim_at_light(scene, path, &surface, &shading, active, &sampler, &shadow.ray
                                    GUIDING_ARGUMENT(&guiding));
        if (ANY(sends)) PACK(shadow, sends, w->shadows, *sent)
#endif
        ireal goes = go_on(scene, path, &surface, &shading, active, depth, w->launch->max_depth, &sampler
                            GUIDING_ARGUMENT(&guiding));
        if (ANY(goes)) PACK(a.travel, goes, w->arrivals, going)
        dimension = sampler.dimension;
    }
#if SHADOWS
    FILL_UP(Shadow, w->shadows, *sent)
#endif
    w->dimension = dimension;
    return going;
}
#endif

#if SHADOWS
// Stage 5: trace the shadow rays and add the direct light of those that are unoccluded.
__attribute__((noinline)) static void trace_shadows(Scene *scene, Wave *w, int count, int depth) {
    for (int i = 0; i < count; i += LANES) {
        Shadow shadow;
        LOAD(shadow, w->shadows, i)
        SET_SLOT_OBJECTS_TIME(w, shadow.slot)
        real3 light = add_light(w, shadow.slot, light_along(scene, &shadow.ray, lanes_of(i, count)), depth + 1);
#if EMITTER_GROUPS
        add_group_light(w, shadow.slot, group_of(scene, shadow.ray.light), light);
#endif
    }
    w->rays += count;
}
#endif

#if DIRECT_LIGHT
// Save the light accumulated so far as the direct light.
static inline void keep_direct(Wave *w) {
    for (int c = 0; c < 3; ++c) for (int i = 0; i < WAVE; ++i) w->direct[c][i] = w->light[c][i];
}
#endif

static inline real3 slots_light(const float rows[3][WAVE], int first) {
    return vector(vload8(0, rows[0] + first), vload8(0, rows[1] + first), vload8(0, rows[2] + first));
}

// Add the samples of each pixel in order, so that sums do not depend on how samples are split into waves. All rays of
// a tile are counted in its first pixel. first_pixel: index of the tile's first pixel in the launch.
static inline void add_samples(const Wave *w, global Pixel *film, uint first_pixel, int slots) {
    for (int i = 0; i < TILE_PIXELS; i += LANES) {
        ureal slot = (uint)i + LANE_INDEX;
        ireal inside = in_picture(w, slot);
#if FILM_WINDOWS
        ureal index = first_pixel + (inside ? slot : (ureal)(0));
#else
        ureal index = inside ? slot_y(w, slot) * w->launch->width + slot_x(w, slot) : w->y * w->launch->width + w->x;
#endif
        Accumulator pixels = load_pixels(film, AS_INT(index));
        pixels.rays += slot == 0 ? (ureal)(w->rays) : (ureal)(0);
        for (int first = i; first < slots; first += TILE_PIXELS) {
#if CATCHER
            if (w->launch->bare) {
                accumulate_bare(&pixels, slots_light(w->light, first), inside);
                continue;
            }
#endif
            ireal kept = accumulate(&pixels, slots_light(w->light, first), inside);
#if DIRECT_LIGHT
            accumulate_direct(&pixels, slots_light(w->direct, first), kept);
#endif
#if CLAMP
            pixels.clamped += kept ? vload8(0, w->removed + first) : ZERO;
#endif
#if ALPHA
            accumulate_alpha(&pixels, vload8(0, w->alpha + first), kept);
#endif
#if CATCHER
            ireal caught = kept & (vload8(0, w->caught + first) > 0.0f);
            accumulate_caught(&pixels, slots_light(w->light, first), caught);
            kept = kept & !caught;
#endif
#if EMITTER_GROUPS
            for (int g = 0; g < GROUPS; ++g) accumulate_group(&pixels, g, slots_light(w->groups + 3 * g, first), kept);
#endif
        }
        store_pixels(film, index, inside, &pixels);
    }
}

__attribute__((vec_type_hint(real)))
kernel void wavefront(SCENE_PARAMETERS, global Pixel *film, global const uint *tiles, const Launch launch) {
    Scene scene = SCENE_ARGUMENTS;
    CHOOSE_WORLD(scene, launch)
    uint first = (uint)get_global_id(0) * TILE_PIXELS;
    if (first >= launch.pixel_count) return;
    uint across = (launch.width + TILE - 1) / TILE, tile = tiles[(first + launch.first_pixel) / TILE_PIXELS];
    Wave w;
    w.launch = &launch;
    w.x = tile % across * TILE;
    w.y = tile / across * TILE;
    for (uint s = 0; s < launch.sample_count; s += WAVE_SAMPLES) {
        uint samples = launch.sample_count - s < WAVE_SAMPLES ? launch.sample_count - s : WAVE_SAMPLES;
        int slots = (int)(samples * TILE_PIXELS), sent = 0;
        w.sample = launch.first_sample + s;
        w.rays = 0;
        // Generate camera rays
        int count = set_out(&scene, &w, slots);
        for (int depth = 1; count > 0; ++depth) {
            // Trace and shade one path segment per iteration until no path is left
            trace(&scene, &w, count, depth);
            count = sort_out(&scene, &w, count, depth);
#if PRIMITIVES
            count = shade(&scene, &w, count, depth, &sent);
#endif
#if DIRECT_LIGHT
            if (depth == 2) keep_direct(&w);
#endif
#if SHADOWS
            trace_shadows(&scene, &w, sent, depth);
#endif
#if DIRECT_LIGHT
            if (depth == 1) keep_direct(&w);   // includes all paths that end here
#endif
        }
        // Accumulate the wave's samples in the film
        add_samples(&w, film, first, slots);
    }
}
