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

static inline LightSample triangle_light_sample(const Scene *scene, ireal index, real3 p, real2 u) {
    real2 b = sample_triangle(u);
    ireal whole = GATHER(ireal, scene->triangle_lights, index, .parallelogram) != 0;
    b = (real2){whole ? u.x : b.x, whole ? u.y : b.y};
    real3 p0 = GATHER3(scene->triangle_lights, index, .p0);
    real3 e1 = scale(GATHER3(scene->triangle_lights, index, .e1), b.x);
    real3 e2 = scale(GATHER3(scene->triangle_lights, index, .e2), b.y);
    real3 q = add(p0, add(e1, e2));
    real3 n = GATHER3(scene->triangle_lights, index, .normal);
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
    Surface surface;
    triangle_surface(scene, &sampled, sampled.primitive, &surface);
    s.radiance = scale(s.radiance, opacity_at(scene, &surface, s.wi, false));
#endif
    s.pdf = front ? d2 / (cosine * GATHER(real, scene->triangle_lights, index, .area)) : ONE;
    s.target = shadow_target(p, q, add(absolute3(p0), add(absolute3(e1), absolute3(e2))), n);
    s.infinite = s.delta = NO_LANES;
    return s;
}

static inline real triangle_light_pdf(const Scene *scene, ireal index, real3 p, real3 wi, real t, const Surface *surface) {
    return t * t / (absolute(dot3(wi, surface->ng)) * GATHER(real, scene->triangle_lights, index, .area));
}

static inline real3 triangle_light_radiance(const Scene *scene, ireal index, real3 wi, const Surface *surface) {
    real3 radiance = GATHER3(scene->triangle_lights, index, .radiance);
#if EMISSION_TEXTURES
    radiance = textured3(scene, GATHER(ireal, scene->triangle_lights, index, .texture), radiance, &surface->at);
#endif
    return choose(triangle_light_cosine(scene, index, -dot3(wi, surface->ng)) > 0.0f, radiance, splat(ZERO));
}
