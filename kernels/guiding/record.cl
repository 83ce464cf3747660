// Training of a guiding field: paths through each pixel, with the vertices at which a direction was sampled from BSDF
// or field. A work-item takes LANES pixels and traces one path through each.
//
// The record is PathRecord: the luminance at the camera of all light that the path brings, and rows of words, one per
// vertex: position; direction to the next vertex, as a point of the unit square in 16-bit fixed point,
// azimuth below; luminance at the camera of the light brought so far; throughput of the direction, at the camera, or 0
// if the path ends here; density with which it was sampled, and that of the BSDF alone; luminance of the sample's
// weight; shading normal. Light that arrives along the direction is estimated as (all light − light so far)/throughput.
#include "integrator/camera_rays.cl"
#include "film/film.cl"
#include "integrator/path_segment.cl"

// Where lanes record their paths, and how many vertices they have recorded.
typedef struct {
    global PathRecord *pixels;
    ureal index;
    int count[LANES];
} Record;

#define RECORD_PARAMETER , Record *record

static inline void record_vertex(Record *record, const Path *path, const Surface *surface, real3 L, ireal active,
                                 ireal goes) {
    ireal recorded = active & !path->specular;
    real2 at = square_of(path->wi);
    ureal direction = TO_UINT(at.x * 65536.0f) | TO_UINT(at.y * 65536.0f) << 16;
    real so_far = luminance(L), throughput = goes ? luminance(at_eye(path, splat(ONE))) : ZERO;
    for (int lane = 0; lane < LANES; ++lane) {
        int place = record->count[lane];
        if (!LANE_INT(recorded, lane) || place == VERTICES) continue;
        record->count[lane] = place + 1;
        global float *words = record->pixels[LANE_UINT(record->index, lane)].vertices[place];
        words[0] = LANE(surface->p.x, lane);
        words[1] = LANE(surface->p.y, lane);
        words[2] = LANE(surface->p.z, lane);
        words[3] = as_float(LANE_UINT(direction, lane));
        words[4] = LANE(so_far, lane);
        words[5] = LANE(throughput, lane);
        words[6] = LANE(path->pdf, lane);
        words[7] = LANE(path->bsdf_pdf, lane);
        words[8] = LANE(path->weight, lane);
        words[9] = LANE(surface->ns.x, lane);
        words[10] = LANE(surface->ns.y, lane);
        words[11] = LANE(surface->ns.z, lane);
    }
}

#include "integrator/path_segments.cl"

__attribute__((vec_type_hint(real)))
kernel void record_paths(SCENE_PARAMETERS, global PathRecord *pixels, global const uint *tiles, const Launch launch) {
    Scene scene = SCENE_ARGUMENTS;
    CHOOSE_WORLD(scene, launch)
    LanePixels own;
    if (!lane_pixels(&launch, tiles, &own)) return;
    Sampler sampler = sampler_at(own.code, (ureal)(launch.first_sample), launch.seed, launch.block_bits);
    SET_TIME(scene, launch, sampler, own.y)
    CameraRay ray;
    ireal active = own.inside & camera_ray(&scene, &launch, own.x, own.y, next_2d(&sampler), &sampler, &ray);
    Record record = {pixels, own.index};
    for (int lane = 0; lane < LANES; ++lane) record.count[lane] = 0;
    real3 direct;
    real removed = ZERO;
    ureal rays = (ureal)(0);
#if ALPHA
    real alpha = ZERO;
#endif
#if CATCHER
    ireal caught = NO_LANES;
#endif
#if EMITTER_GROUPS
    real3 groups[GROUPS];
    for (int g = 0; g < GROUPS; ++g) groups[g] = splat(ZERO);
#endif
    real3 L = light_of_path(&scene, &launch, path_along(ray.origin, ray.direction), 1, active, &sampler, &rays, &direct,
                            &removed ALPHA_ARGUMENT(&alpha) CATCHER_ARGUMENT(&caught) GROUPS_ARGUMENT(groups),
                            &record);
    if (loops_ended(launch.width)) return;
    real all = luminance(L);
    for (int lane = 0; lane < LANES; ++lane) {
        if (!LANE_INT(own.inside, lane)) continue;
        global PathRecord *pixel = pixels + LANE_UINT(own.index, lane);
        pixel->light = LANE(all, lane);
        pixel->count = record.count[lane];
    }
}
