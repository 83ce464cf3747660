// Triangle light, or the parallelogram of two triangles, single- or double-sided: points uniform over its area. World
// frame.
#include "light/interface.cl"
#include OPACITY_FILE

// The cosine on the emitting side, given that on the front side; for double-sided lights it is positive on the back as
// well.
static inline real triangle_light_cosine(const Scene *scene, ireal index, real front) {
#if DOUBLE_SIDED_LIGHTS
    front = GATHER(ireal, scene->triangle_lights, index, .double_sided) != 0 ? absolute(front) : front;
#endif
    return front;
}

#if MOVING_LIGHTS
// Corner, edges, normal and area of a light, and the rounding error of its place.
typedef struct { real3 p0, e1, e2, normal, error; real area; } LightShape;

// The shape of a light where it is at the scene's time.
static inline LightShape moved_light(const Scene *scene, ireal index) {
    LightShape light = {GATHER3(scene->triangle_lights, index, .p0), GATHER3(scene->triangle_lights, index, .e1),
                        GATHER3(scene->triangle_lights, index, .e2), GATHER3(scene->triangle_lights, index, .normal),
                        splat(ZERO), GATHER(real, scene->triangle_lights, index, .area)};
    ireal number = GATHER(ireal, scene->light_placements, index, .placement), moves = number >= 0;
    if (!ANY(moves)) return light;
    ireal instance = moves ? number : (ireal)(0);
    Place place = place_of(scene, instance);
    real3 e1 = placed_vector(&place, light.e1), e2 = placed_vector(&place, light.e2), across = cross3(e1, e2);
    real whole = GATHER(ireal, scene->triangle_lights, index, .parallelogram) != 0 ? ONE : (real)(0.5f);
    Surface corner;
    corner.p = light.p0;
    corner.p_error = splat(ZERO);
    corner.ng = light.normal;
    place_surface(scene, instance, &place, &corner);
    light.p0 = choose(moves, corner.p, light.p0);
    light.e1 = choose(moves, e1, light.e1);
    light.e2 = choose(moves, e2, light.e2);
    light.normal = choose(moves, corner.ng, light.normal);
    light.error = choose(moves, corner.p_error, light.error);
    light.area = moves ? whole * length3(across) : light.area;
    return light;
}
#endif

static inline LightSample triangle_light_sample(const Scene *scene, ireal index, real3 p, real2 u) {
    real2 b = sample_triangle(u);
    ireal whole = GATHER(ireal, scene->triangle_lights, index, .parallelogram) != 0;
    b = (real2){whole ? u.x : b.x, whole ? u.y : b.y};
#if MOVING_LIGHTS
    LightShape light = moved_light(scene, index);
    real3 p0 = light.p0, e1 = scale(light.e1, b.x), e2 = scale(light.e2, b.y), n = light.normal;
#else
    real3 p0 = GATHER3(scene->triangle_lights, index, .p0);
    real3 e1 = scale(GATHER3(scene->triangle_lights, index, .e1), b.x);
    real3 e2 = scale(GATHER3(scene->triangle_lights, index, .e2), b.y);
    real3 n = GATHER3(scene->triangle_lights, index, .normal);
#endif
    real3 q = add(p0, add(e1, e2));
    real3 d = sub(q, p);
    real d2 = dot3(d, d);
    LightSample s;
    s.wi = scale(d, rsqrt(d2));
    real cosine = triangle_light_cosine(scene, index, -dot3(s.wi, n));
    ireal front = (cosine > 0.0f) & (d2 > 0.0f);
    real3 radiance = GATHER3(scene->triangle_lights, index, .radiance);
#if EMISSION_TEXTURES
    Coordinates at = triangle_coordinates(scene, GATHER(ireal, scene->triangle_lights, index, .primitive), 1.0f - b.x - b.y, b.x, b.y);
    radiance = textured3(scene, GATHER(ireal, scene->triangle_lights, index, .texture), radiance, &at);
#endif
    s.radiance = choose(front, radiance, splat(ZERO));
#if OPACITY
    Hits sampled = {ZERO, b.x, b.y, GATHER(ireal, scene->triangle_lights, index, .primitive)};
#if MOVING_LIGHTS
    ireal placement = GATHER(ireal, scene->light_placements, index, .placement);
    sampled.instance = placement < 0 ? (ireal)(0) : placement;
#endif
    Surface surface;
    triangle_surface(scene, &sampled, sampled.primitive, &surface);
    s.radiance = scale(s.radiance, opacity_at(scene, &surface, s.wi, false));
#endif
#if MOVING_LIGHTS
    s.pdf = front ? d2 / (cosine * light.area) : ONE;
    real3 size = mad3(light.error, (real)(1.0f / GAMMA(16)), add(absolute3(p0), add(absolute3(e1), absolute3(e2))));
    s.target = shadow_target(p, q, size, n);
#else
    s.pdf = front ? d2 / (cosine * GATHER(real, scene->triangle_lights, index, .area)) : ONE;
    s.target = shadow_target(p, q, add(absolute3(p0), add(absolute3(e1), absolute3(e2))), n);
#endif
    s.infinite = s.delta = NO_LANES;
    return s;
}

static inline real triangle_light_pdf(const Scene *scene, ireal index, real3 p, real3 wi, real t, const Surface *surface) {
#if MOVING_LIGHTS
    real area = moved_light(scene, index).area;
#else
    real area = GATHER(real, scene->triangle_lights, index, .area);
#endif
    return t * t / (absolute(dot3(wi, surface->ng)) * area);
}

static inline real3 triangle_light_radiance(const Scene *scene, ireal index, real3 wi, const Surface *surface) {
    real3 radiance = GATHER3(scene->triangle_lights, index, .radiance);
#if EMISSION_TEXTURES
    radiance = textured3(scene, GATHER(ireal, scene->triangle_lights, index, .texture), radiance, &surface->at);
#endif
    return choose(triangle_light_cosine(scene, index, -dot3(wi, surface->ng)) > 0.0f, radiance, splat(ZERO));
}
