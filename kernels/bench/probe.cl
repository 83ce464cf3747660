// Kernels that apply one function each to arrays, LANES elements per work-item (clrt/bench/kernel_probe.py).
//
// Compiled into a scene's program in place of integrator/path.cl, so the probed code is that which renders the scene.
// Arrays are rows of n floats: row r of element i is array[r·n + i]. Integers up to 2^24 and masks (0, 1) are stored
// as floats.
#include "surface/shading.cl"
#include "integrator/camera_rays.cl"
#include "film/film.cl"
#include "light/dispatch.cl"

#define ELEMENTS \
    Scene scene = SCENE_ARGUMENTS; \
    ureal element = (ureal)((uint)get_global_id(0) * LANES) + LANE_INDEX; \
    ireal active = element < (ureal)(n); \
    element = active ? element : (ureal)(0);
#define ROW(array, row) GATHER(real, (array) + (row) * n, element, )
#define ROW3(array, row) vector(ROW(array, row), ROW(array, (row) + 1), ROW(array, (row) + 2))
#define FLAG(mask) ((mask) ? ONE : ZERO)

static void put(global float *out, uint n, uint row, real value) {
    RealLanes lanes;
    lanes.all = value;
    uint first = (uint)get_global_id(0) * LANES;
    for (uint lane = 0; lane < LANES && first + lane < n; ++lane) out[row * n + first + lane] = lanes.lane[lane];
}

static void put3(global float *out, uint n, uint row, real3 value) {
    put(out, n, row, value.x);
    put(out, n, row + 1, value.y);
    put(out, n, row + 2, value.z);
}

// in: u (2), cone height -> out: cosine wi (3), pdf; cone wi (3), pdf; triangle b1, b2; sine, cosine of 2·pi·u.x
kernel void probe_warps(SCENE_PARAMETERS, uint n, global const float *in, global float *out) {
    ELEMENTS
    real2 u = {ROW(in, 0), ROW(in, 1)};
    real height = ROW(in, 2), sine, cosine;
    real3 cosine_wi = sample_cosine(u);
    put3(out, n, 0, cosine_wi);
    put(out, n, 3, cosine_pdf(cosine_wi.z));
    put3(out, n, 4, sample_cone(u, height));
    put(out, n, 7, cone_pdf(height));
    real2 b = sample_triangle(u);
    put(out, n, 8, b.x);
    put(out, n, 9, b.y);
    sincos_turns(u.x, &sine, &cosine);
    put(out, n, 10, sine);
    put(out, n, 11, cosine);
}

// in: pixel (of 32 bits, as two halves), sample (as two halves) -> out: u (2)
kernel void probe_random(SCENE_PARAMETERS, uint n, global const float *in, global float *out, uint seed, uint dimension,
                         uint block_bits) {
    ELEMENTS
    Sampler sampler = sampler_at((TO_UINT(ROW(in, 0)) << 16) + TO_UINT(ROW(in, 1)),
                                 (TO_UINT(ROW(in, 2)) << 16) + TO_UINT(ROW(in, 3)), seed, block_bits);
    sampler.dimension = dimension;
    real2 u = next_2d(&sampler);
    put(out, n, 0, u.x);
    put(out, n, 1, u.y);
}

// in: two radiances (3 each), and previous sums, sum_errors, squares, square_errors (3 each) -> out: these with
// `samples` samples added, every `period`-th of the second radiance; the numbers counted and dropped
kernel void probe_accumulate(SCENE_PARAMETERS, uint n, global const float *in, global float *out, uint samples, uint period) {
    ELEMENTS
    Accumulator a = {ROW3(in, 6), ROW3(in, 9), ROW3(in, 12), ROW3(in, 15), (ureal)(0), (ureal)(0), (ureal)(0)};
    real3 often = ROW3(in, 0), seldom = ROW3(in, 3);
    for (uint i = 1; i <= samples; ++i) accumulate(&a, i % period ? often : seldom, active);
    put3(out, n, 0, a.sum);
    put3(out, n, 3, a.sum_error);
    put3(out, n, 6, a.square);
    put3(out, n, 9, a.square_error);
    put(out, n, 12, TO_REAL(a.count));
    put(out, n, 13, TO_REAL(a.dropped));
}

// A material, by its code, on a surface seen from wo, at the origin of its texture coordinates.
static Bsdf material_at(const Scene *scene, real code, real3 wo, ireal front) {
    Surface surface;
    surface.material = TO_INT(code);
    surface.front = front;
    surface.cos_o = wo.z;
#if TEXTURES
    for (int i = 0; i < UV_SETS; ++i) surface.at.set[i] = (real2){ZERO, ZERO};
#endif
#if COAT_NORMALS
    surface.unbent = surface.ns = vector(ZERO, ZERO, ONE);
    surface.tangent = vector(ONE, ZERO, ZERO);
    surface.handedness = ONE;
    bend_normal(scene, &surface);
    surface.cos_o = dot3(surface.ns, wo);
    surface.coat_cos_o = dot3(surface.coat_normal, wo);
#endif
#if (ANISOTROPY || BRUSH) && !COAT_NORMALS
    surface.ns = vector(ZERO, ZERO, ONE);
    surface.tangent = vector(ONE, ZERO, ZERO);
    surface.handedness = ONE;
#endif
#if ANISOTROPY
    surface.towards = wo;
#endif
#if DISPERSION
    surface.throughput = splat(ONE);
#endif
    Bsdf bsdf;
    bsdf_at(scene, &surface, &bsdf);
    return bsdf;
}

// in: material, wo (3), u (2), lobe -> out: wi (3), weight (3), pdf, specular, spread; seen from the front if `front`
kernel void probe_bsdf_sample(SCENE_PARAMETERS, uint n, global const float *in, global float *out, uint front) {
    ELEMENTS
    real2 u = {ROW(in, 4), ROW(in, 5)};
    Bsdf bsdf = material_at(&scene, ROW(in, 0), ROW3(in, 1), front ? ALL_LANES : NO_LANES);
    BsdfSample sample = bsdf_sample(&bsdf, ROW3(in, 1), u, ROW(in, 6));
    put3(out, n, 0, sample.wi);
    put3(out, n, 3, sample.weight);
    put(out, n, 6, sample.pdf);
    put(out, n, 7, FLAG(sample.specular));
#if TRANSMISSION
    put(out, n, 8, sample.spread);
#else
    put(out, n, 8, ONE);
#endif
}

// in: material, wo (3), wi (3) -> out: f·|cos| (3), pdf; seen from the front if `front`
kernel void probe_bsdf_value(SCENE_PARAMETERS, uint n, global const float *in, global float *out, uint front) {
    ELEMENTS
    Bsdf bsdf = material_at(&scene, ROW(in, 0), ROW3(in, 1), front ? ALL_LANES : NO_LANES);
    BsdfValue at = bsdf_eval(&bsdf, ROW3(in, 1), ROW3(in, 4));
    put3(out, n, 0, at.value);
    put(out, n, 3, at.pdf);
}

#if PRIMITIVES
// A material, by its code, on a surface with these normals, seen along −wo, without a normal map.
static Shading shading_between(const Scene *scene, real code, real3 ng, real3 ns, real3 wo, Surface *surface) {
    surface->material = TO_INT(code);
    surface->ng = ng;
    surface->ns = ns;
#if TEXTURES
    for (int i = 0; i < UV_SETS; ++i) surface->at.set[i] = (real2){ZERO, ZERO};
#endif
#if VERTEX_COLORS
    surface->tint = splat(ONE);
#endif
#if TANGENTS
    surface->tangent = ns;
    surface->handedness = ZERO;
#endif
#if NORMAL_MAPS
    surface->unbent = ns;
#endif
#if COAT_NORMALS
    surface->coat_normal = ns;
#endif
#if DISPERSION
    surface->throughput = splat(ONE);
#endif
    return shading_at(scene, negate(wo), surface);
}

// in: material, ng (3), ns (3), wo (3), u (2), lobe -> out: wi (3), weight (3), pdf, specular, spread
kernel void probe_shading_sample(SCENE_PARAMETERS, uint n, global const float *in, global float *out) {
    ELEMENTS
    Surface surface;
    Shading shading = shading_between(&scene, ROW(in, 0), ROW3(in, 1), ROW3(in, 4), ROW3(in, 7), &surface);
    BsdfSample sample = shading_sample(&shading, &surface, (real2){ROW(in, 10), ROW(in, 11)}, ROW(in, 12));
    put3(out, n, 0, sample.wi);
    put3(out, n, 3, sample.weight);
    put(out, n, 6, sample.pdf);
    put(out, n, 7, FLAG(sample.specular));
#if TRANSMISSION
    put(out, n, 8, sample.spread);
#else
    put(out, n, 8, ONE);
#endif
}

// in: material, ng (3), ns (3), wo (3), wi (3) -> out: f·|cos| (3), pdf
kernel void probe_shading_value(SCENE_PARAMETERS, uint n, global const float *in, global float *out) {
    ELEMENTS
    Surface surface;
    Shading shading = shading_between(&scene, ROW(in, 0), ROW3(in, 1), ROW3(in, 4), ROW3(in, 7), &surface);
    BsdfValue at = shading_eval(&shading, &surface, ROW3(in, 10));
    put3(out, n, 0, at.value);
    put(out, n, 3, at.pdf);
}
#endif

#if MATERIAL_METALLIC_ROUGHNESS
// in: wo (3), alpha, u (2) -> out: the sampled visible normal
kernel void probe_visible_normal(SCENE_PARAMETERS, uint n, global const float *in, global float *out) {
    ELEMENTS
    real2 u = {ROW(in, 4), ROW(in, 5)};
    put3(out, n, 0, sample_visible_normal(ROW3(in, 0), ROW(in, 3), u));
}
#endif

// in: origin (3), direction (3) -> out: t, u, v, primitive
kernel void probe_closest_hit(SCENE_PARAMETERS, uint n, global const float *in, global float *out) {
    ELEMENTS
    Hits hits = closest_hit(&scene, ROW3(in, 0), ROW3(in, 3), (real)(INFINITY), active);
    put(out, n, 0, hits.t);
    put(out, n, 1, hits.u);
    put(out, n, 2, hits.v);
    put(out, n, 3, TO_REAL(hits.primitive));
}

// in: origin (3), direction (3), t_max -> out: whether anything is hit
kernel void probe_any_hit(SCENE_PARAMETERS, uint n, global const float *in, global float *out) {
    ELEMENTS
    put(out, n, 0, FLAG(any_hit(&scene, ROW3(in, 0), ROW3(in, 3), ROW(in, 6), active)));
}

#if PRIMITIVES
// in: origin (3), direction (3), new direction (3) -> out: primitive; p, p_error, ng (3 each); the new ray's origin
// (3), its t. All are 0 if the first ray misses.
kernel void probe_leave(SCENE_PARAMETERS, uint n, global const float *in, global float *out) {
    ELEMENTS
    real3 origin = ROW3(in, 0), direction = ROW3(in, 3), next = ROW3(in, 6);
    Hits hits = closest_hit(&scene, origin, direction, (real)(INFINITY), active);
    ireal hit = hits.primitive >= 0;
    Surface surface = surface_at(&scene, origin, direction, &hits);
    real3 left = offset_origin(surface.p, surface.p_error, surface.ng, next);
    Hits again = closest_hit(&scene, left, next, (real)(INFINITY), active & hit);
    put(out, n, 0, TO_REAL(hits.primitive));
    put3(out, n, 1, choose(hit, surface.p, splat(ZERO)));
    put3(out, n, 4, choose(hit, surface.p_error, splat(ZERO)));
    put3(out, n, 7, choose(hit, surface.ng, splat(ZERO)));
    put3(out, n, 10, choose(hit, left, splat(ZERO)));
    put(out, n, 13, hit ? again.t : ZERO);
}
#endif

#if TEXTURES
// in: texture, coordinates u, v -> out: its color (3) and number, with a factor of 1
kernel void probe_texture(SCENE_PARAMETERS, uint n, global const float *in, global float *out) {
    ELEMENTS
    Coordinates at;
    for (int i = 0; i < UV_SETS; ++i) at.set[i] = (real2){ROW(in, 1), ROW(in, 2)};
    ireal texture = TO_INT(ROW(in, 0));
    put3(out, n, 0, textured3(&scene, texture, splat(ONE), &at));
    put(out, n, 3, textured(&scene, texture, ONE, &at));
}
#endif

#if LIGHTS
// in: p (3), n (3) -> out: the light chosen by the random numbers of pixel i, its probability, and the rescaled u
kernel void probe_pick_light(SCENE_PARAMETERS, uint n, global const float *in, global float *out, uint seed) {
    ELEMENTS
    Sampler sampler = sampler_at(element, (ureal)(0), seed, 32);
    real probability, u = next_1d(&sampler);
    ireal light = pick_light(&scene, ROW3(in, 0), ROW3(in, 3), &sampler, &u, &probability);
    put(out, n, 0, TO_REAL(light));
    put(out, n, 1, probability);
    put(out, n, 2, u);
}

// in: p (3), n (3), light -> out: its selection probability
kernel void probe_light_probability(SCENE_PARAMETERS, uint n, global const float *in, global float *out) {
    ELEMENTS
    put(out, n, 0, light_probability(&scene, ROW3(in, 0), ROW3(in, 3), TO_INT(ROW(in, 6))));
}

// in: p (3), n (3) -> out: wi (3), radiance (3), pdf, target (3), infinite, delta. Element i uses the numbers of pixel
// i.
kernel void probe_light_sample(SCENE_PARAMETERS, uint n, global const float *in, global float *out, uint seed) {
    ELEMENTS
    Sampler sampler = sampler_at(element, (ureal)(0), seed, 32);
    ireal number;
    LightSample light = light_sample(&scene, ROW3(in, 0), ROW3(in, 3), &sampler, &number);
    put3(out, n, 0, light.wi);
    put3(out, n, 3, light.radiance);
    put(out, n, 6, light.pdf);
    put3(out, n, 7, light.target);
    put(out, n, 10, FLAG(light.infinite));
    put(out, n, 11, FLAG(light.delta));
}
#endif

#if EMITTERS
// in: p (3), n (3), wi (3) -> out: radiance (3) of the emitter hit, the pdf of light_sample at wi, primitive
kernel void probe_emitter(SCENE_PARAMETERS, uint n, global const float *in, global float *out) {
    ELEMENTS
    real3 p = ROW3(in, 0), wi = ROW3(in, 6);
    Hits hits = closest_hit(&scene, p, wi, (real)(INFINITY), active);
    Surface surface = surface_at(&scene, p, wi, &hits);
    real pdf;
    put3(out, n, 0, emitter_radiance(&scene, p, ROW3(in, 3), wi, hits.t, &surface, active & (hits.primitive >= 0), &pdf));
    put(out, n, 3, pdf);
    put(out, n, 4, TO_REAL(hits.primitive));
}
#endif

#if SKY
// in: p (3), n (3), wi (3) -> out: radiance (3), the pdf of light_sample at wi
kernel void probe_sky(SCENE_PARAMETERS, uint n, global const float *in, global float *out) {
    ELEMENTS
    real pdf;
    put3(out, n, 0, escaped_radiance(&scene, ROW3(in, 0), ROW3(in, 3), ROW3(in, 6), &pdf));
    put(out, n, 3, pdf);
}
#endif

#if LIGHT_SUN
// in: p (3), n (3), wi (3), pdf -> out: radiance (3) from the sky and all suns, and its MIS-weighted part (3) if wi was
// sampled with that pdf
kernel void probe_environment(SCENE_PARAMETERS, uint n, global const float *in, global float *out) {
    ELEMENTS
    put3(out, n, 0, environment_radiance(&scene, ROW3(in, 6) CAMERA_ARGUMENT(false)));
    put3(out, n, 3, environment_light(&scene, ROW3(in, 0), ROW3(in, 3), ROW3(in, 6), ROW(in, 9), NO_LANES
                                 CAMERA_ARGUMENT(false)));
}
#endif
