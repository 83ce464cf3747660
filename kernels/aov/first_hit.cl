// First-hit AOVs for compositing: attributes of the first surface that camera rays hit, without its light.
//
// One work-item renders LANES pixels. SEEN_MEANS lists the AOVs averaged over `sample_count` camera rays per pixel,
// as the image is; SEEN_MIDDLE those taken from the single ray through the pixel centre, at the middle of the
// exposure, with its primitive, because a mean of positions or ids is meaningless. The host writes both lists,
// according to the AOVs requested. With ONE_SAMPLE that ray is the pixel's sample number first_sample instead. On a
// miss all values are 0 and the primitive is -1. World frame.
//
// SEEN_FILES are the files of the materials, if a requested AOV depends on them. To add an AOV: add a function
// seen_NAME here, with the same value in x, y and z if it has one channel, and its entry in clrt/aov_types.py.
#include "integrator/camera_rays.cl"
#include "film/film.cl"
#include "visibility/interface.cl"
#include SEEN_FILES

#if PRIMITIVES
#if SEEN_MATERIALS
static inline real3 seen_albedo(const Scene *scene, const Surface *surface) {
    Bsdf bsdf;
    bsdf_at(scene, surface, &bsdf);
    return bsdf_albedo(&bsdf);
}
#endif

static inline real3 seen_normal(const Scene *scene, const Surface *surface) { return surface->ns; }

static inline real3 seen_geometric_normal(const Scene *scene, const Surface *surface) { return surface->ng; }

static inline real3 seen_position(const Scene *scene, const Surface *surface) { return surface->p; }

// Intersect camera rays with the first surface that is not transparent and turn it towards the camera. Returns the
// lanes that hit one.
static inline ireal intersect(const Scene *scene, const CameraRay *ray, ireal active, Sampler *sampler,
                              Surface *surface, ireal *primitive, ireal *instance) {
    Hits hits = first_surface(scene, ray->origin, ray->direction, true, active, sampler);
    *surface = surface_at(scene, ray->origin, ray->direction, &hits);
    ireal hit = active & (hits.primitive >= 0);
    *primitive = hit ? hits.primitive : (ireal)(-1);
    *instance = hit ? hits.instance : (ireal)(0);
#if SEEN_MATERIALS && NORMAL_MAPS
    bend_normal(scene, surface);
#endif
    turn_towards(surface, negate(ray->direction));
    surface->p = mad3(ray->direction, hits.t, ray->origin);   // surface->p is pulled inwards from a triangle's edges
    return hit;
}
#endif

__attribute__((vec_type_hint(real)))
kernel void first_hit(SCENE_PARAMETERS, global FirstHit *pixels, global const uint *tiles, const Launch launch) {
    Scene scene = SCENE_ARGUMENTS;
    LanePixels own;
    if (!lane_pixels(&launch, tiles, &own)) return;
    ireal primitive = (ireal)(-1), instance = (ireal)(0);
#define BEGIN(name) real3 name = splat(ZERO);
    SEEN_MEANS(BEGIN)
    SEEN_MIDDLE(BEGIN)
#if PRIMITIVES
    Surface surface;
    Sampler sampler;
    CameraRay ray;
    ireal active, hit, other;
#define ADD(name) name = add(name, choose(hit, seen_##name(&scene, &surface), splat(ZERO)));
    for (uint s = 0; s < launch.sample_count; ++s) {
        sampler = sampler_at(own.code, (ureal)(s), launch.seed, launch.block_bits);
        SET_TIME(scene, launch, sampler, own.y)
        active = own.inside & camera_ray(&scene, &launch, own.x, own.y, next_2d(&sampler), &sampler, &ray);
        hit = intersect(&scene, &ray, active, &sampler, &surface, &other, &other);
        SEEN_MEANS(ADD)
    }
#if ONE_SAMPLE
    sampler = sampler_at(own.code, (ureal)(launch.first_sample), launch.seed, launch.block_bits);
    SET_TIME(scene, launch, sampler, own.y)
    active = own.inside & camera_ray(&scene, &launch, own.x, own.y, next_2d(&sampler), &sampler, &ray);
#else
    real2 middle = {(real)(0.5f), (real)(0.5f)};
    Launch pinhole = launch;
    pinhole.lens_radius = 0.0f;   // use the ray through the centre of a lens as well
    sampler = sampler_at(own.code, (ureal)(0), launch.seed, launch.block_bits);
    SET_MIDDLE_TIME(scene, launch, own.y)
    active = own.inside & camera_ray(&scene, &pinhole, own.x, own.y, middle, &sampler, &ray);
#endif
    hit = intersect(&scene, &ray, active, &sampler, &surface, &primitive, &instance);
    SEEN_MIDDLE(ADD)
#endif
    if (loops_ended(launch.width)) return;
#define DIVIDE(name) name = scale(name, (real)(1.0f / (float)launch.sample_count));
    SEEN_MEANS(DIVIDE)
    for (int lane = 0; lane < LANES; ++lane) {
        if (!LANE_INT(own.inside, lane)) continue;
        global FirstHit *pixel = pixels + LANE_UINT(own.index, lane);
        pixel->primitive = LANE_INT(primitive, lane);
        pixel->instance = LANE_INT(instance, lane);
#define STORE(name) store_rows(pixel->name, &name, lane);
        SEEN_MEANS(STORE)
        SEEN_MIDDLE(STORE)
    }
}
