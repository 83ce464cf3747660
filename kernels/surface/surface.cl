// Surface interaction: position with its error bound, normals, material and emitter. World frame.
//
// The position is reconstructed from the primitive, not (except for some spheres) from origin + t·direction: its
// error is a few roundings of the primitive's coordinates, however long the ray is (pbrt, 4th ed., 6.8). offset/
// defines the origins of spawned rays. An instanced mesh is stored once, in its object frame
// (surface/instance_transform.cl).
#include "traverse/trace.cl"
#include TEXTURE_FILES

#define TANGENTS (NORMAL_MAPS || ANISOTROPY || BRUSH)

typedef struct {
    real3 p, p_error;     // |p − exact| <= p_error by component
    real3 ng, ns;         // geometric and shading normal, both on the front side
    ireal material;       // type | index << 4
    ireal light;          // entry of the light table, or -1
    ireal front;          // whether the ray hit the front side; set by turn_towards
    real cos_o;           // cosine of ns with the direction to the viewer; set by turn_towards
#if TEXTURES
    Coordinates at;
#endif
#if VERTEX_COLORS
    real3 tint;
    real tint_opacity;
#endif
#if TANGENTS
    real3 tangent;        // not of unit length
    real handedness;      // of the bitangent; 0 without tangents, 2 on spheres (place_sphere_tangent)
#endif
#if NORMAL_MAPS
    real3 unbent;         // the shading normal before normal mapping
#endif
#if ANISOTROPY
    real3 towards;        // the direction to the viewer; set by turn_towards
#endif
#if DISPERSION
    real3 throughput;     // of the path that arrives; 1 unless it is set
#endif
#if COAT_NORMALS
    real3 coat_normal;    // the shading normal after the coat's own normal map (surface/normal_maps.cl)
    real coat_cos_o;      // as cos_o, for coat_normal
#endif
} Surface;

#include PLACEMENT_FILE
#if !INSTANCES
#define PLACED_NORMAL(n) n
#define PLACED_TANGENT(t) t
#endif

#if TRIANGLES
// Minimum barycentric coordinate: points closer to an edge than this fraction of the triangle's height are pulled
// inwards in its plane. That exceeds the offset of spawned rays, so that rays from a corner of two walls do not start
// behind the other wall.
#define INWARD (32.0f * UNIT_ROUNDOFF)

// The edges are scaled to a length near 1 first: the square of their product must not leave the range of floats.
static inline real3 triangle_normal(real3 e1, real3 e2) {
    real3 n = cross3(scale(e1, 1.0f / largest(absolute3(e1))), scale(e2, 1.0f / largest(absolute3(e2))));
    return normalize3(n);
}

static inline void triangle_surface(const Scene *scene, const Hits *hits, ireal primitive, Surface *surface) {
    real3 p0 = GATHER3(scene->triangles, primitive, .p0);
    real3 p1 = GATHER3(scene->triangles, primitive, .p1);
    real3 p2 = GATHER3(scene->triangles, primitive, .p2);
    real b1 = hits->u, b2 = hits->v, b0 = 1.0f - b1 - b2;
    real inner1 = minimum(maximum(b1, (real)(INWARD)), (real)(1.0f - 2.0f * INWARD));
    real inner2 = minimum(maximum(b2, (real)(INWARD)), 1.0f - INWARD - inner1);
    real inner0 = 1.0f - inner1 - inner2;
    surface->p = mad3(p0, inner0, mad3(p1, inner1, scale(p2, inner2)));
    real3 size = mad3(absolute3(p0), inner0, mad3(absolute3(p1), inner1, scale(absolute3(p2), inner2)));
    surface->p_error = scale(size, (real)(GAMMA(9)));
    surface->ng = triangle_normal(sub(p1, p0), sub(p2, p0));
#if INSTANCES
    ireal instance = hits->primitive < 0 ? (ireal)(0) : hits->instance;
    Place place = place_of(scene, instance);
    place_surface(scene, instance, &place, surface);
#endif
    surface->ns = surface->ng;
    surface->material = GATHER(ireal, scene->triangles, primitive, .material);
    surface->light = GATHER(ireal, scene->triangles, primitive, .light);
#if INSTANCES
    ireal material = GATHER(ireal, scene->placements, instance, .material);
    surface->material = material < 0 ? surface->material : material;
#endif
#if SMOOTH_NORMALS
    ireal normals = GATHER(ireal, scene->triangles, primitive, .normals);
    ireal smooth = normals >= 0;
    if (ANY(smooth)) {
        normals = smooth ? normals : (ireal)(0);
        real3 ns = mad3(PLACED_NORMAL(GATHER3(scene->normals, normals, .n0)), b0,
                   mad3(PLACED_NORMAL(GATHER3(scene->normals, normals, .n1)), b1,
                        scale(PLACED_NORMAL(GATHER3(scene->normals, normals, .n2)), b2)));
        real norm2 = dot3(ns, ns);
        surface->ns = choose(smooth & (norm2 > 0.0f), scale(ns, rsqrt(norm2)), surface->ns);
    }
#endif
#if TEXTURES
    surface->at = triangle_coordinates(scene, primitive, b0, b1, b2);
#endif
#if VERTEX_COLORS
    surface->tint = mad3(GATHER3(scene->colors, primitive, .c0), b0,
                    mad3(GATHER3(scene->colors, primitive, .c1), b1, scale(GATHER3(scene->colors, primitive, .c2), b2)));
#endif
#if VERTEX_COLORS && OPACITY
    surface->tint_opacity = b0 * GATHER(real, scene->colors, primitive, .c0[3]) + b1 * GATHER(real, scene->colors, primitive, .c1[3])
                          + b2 * GATHER(real, scene->colors, primitive, .c2[3]);
#endif
#if TANGENTS
    surface->tangent = mad3(PLACED_TANGENT(GATHER3(scene->tangents, primitive, .t0)), b0,
                       mad3(PLACED_TANGENT(GATHER3(scene->tangents, primitive, .t1)), b1,
                            scale(PLACED_TANGENT(GATHER3(scene->tangents, primitive, .t2)), b2)));
    surface->handedness = GATHER(real, scene->tangents, primitive, .sign);
#if INSTANCES
    surface->handedness *= place.side;
#endif
#endif
}
#endif

#if SPHERES
static inline void sphere_surface(const Scene *scene, real3 origin, real3 direction, const Hits *hits, ireal sphere,
                                  Surface *surface) {
    real3 center = GATHER3(scene->spheres, sphere, .center);
    real radius = GATHER(real, scene->spheres, sphere, .radius);
    real3 met = mad3(direction, hits->t, origin);
    real3 n = normalize3(sub(met, center));
    surface->p = mad3(n, radius, center);
    surface->p_error = scale(add(absolute3(center), splat(radius)), (real)(GAMMA(9)));
    // For a huge or distant sphere, such as a ground, the point along the ray is more accurate: t is accurate to 3
    // ulps.
    real3 met_error = scale(mad3(absolute3(direction), hits->t, absolute3(origin)), (real)(GAMMA(6)));
    ireal nearby = largest(met_error) < largest(surface->p_error);
    surface->p = choose(nearby, met, surface->p);
    surface->p_error = choose(nearby, met_error, surface->p_error);
    surface->ng = surface->ns = n;
#if TEXTURES
    surface->at = sphere_coordinates(n);
#endif
#if VERTEX_COLORS
    surface->tint = splat(ONE);
    surface->tint_opacity = ONE;
#endif
#if TANGENTS
    surface->tangent = vector(n.z, ZERO, -n.x);     // of length sin θ
    surface->handedness = (real)(2.0f);
#endif
    surface->material = GATHER(ireal, scene->spheres, sphere, .material);
    surface->light = GATHER(ireal, scene->spheres, sphere, .light);
}
#endif

// Return the indices of the primitives at the hits in the buffers of all; 0 in lanes that missed.
static inline ireal stored_primitive(const Scene *scene, const Hits *hits) {
    ireal primitive = hits->primitive < 0 ? (ireal)(0) : hits->primitive;
#if INSTANCES
    ireal instance = hits->primitive < 0 ? (ireal)(0) : hits->instance;
    primitive += hits->primitive < 0 ? (ireal)(0) : GATHER(ireal, scene->placements, instance, .first);
#endif
    return primitive;
}

// Return the surfaces at the hits; lanes that missed get the surface of primitive 0.
static inline Surface surface_at(const Scene *scene, real3 origin, real3 direction, const Hits *hits) {
    Surface surface;
    ireal primitive = stored_primitive(scene, hits);
#if TRIANGLES && SPHERES
    ireal is_sphere = primitive >= scene->counts.triangles;
    triangle_surface(scene, hits, is_sphere ? (ireal)(0) : primitive, &surface);
    if (ANY(is_sphere)) {
        Surface other;
        sphere_surface(scene, origin, direction, hits, is_sphere ? primitive - scene->counts.triangles : (ireal)(0), &other);
        surface.p = choose(is_sphere, other.p, surface.p);
        surface.p_error = choose(is_sphere, other.p_error, surface.p_error);
        surface.ng = choose(is_sphere, other.ng, surface.ng);
        surface.ns = choose(is_sphere, other.ns, surface.ns);
        surface.material = is_sphere ? other.material : surface.material;
        surface.light = is_sphere ? other.light : surface.light;
#if TEXTURES
        for (int i = 0; i < UV_SETS; ++i) {
            surface.at.set[i].x = is_sphere ? other.at.set[i].x : surface.at.set[i].x;
            surface.at.set[i].y = is_sphere ? other.at.set[i].y : surface.at.set[i].y;
        }
#endif
#if VERTEX_COLORS
        surface.tint = choose(is_sphere, other.tint, surface.tint);
        surface.tint_opacity = is_sphere ? other.tint_opacity : surface.tint_opacity;
#endif
#if TANGENTS
        surface.tangent = choose(is_sphere, other.tangent, surface.tangent);
        surface.handedness = is_sphere ? other.handedness : surface.handedness;
#endif
    }
#elif TRIANGLES
    triangle_surface(scene, hits, primitive, &surface);
#elif SPHERES
    sphere_surface(scene, origin, direction, hits, primitive, &surface);
#endif
#if NORMAL_MAPS
    surface.unbent = surface.ns;
#endif
#if COAT_NORMALS
    surface.coat_normal = surface.ns;
#endif
#if DISPERSION
    surface.throughput = splat(ONE);
#endif
    return surface;
}

// Flip a shading normal to the side of the geometric one, which replaces it if it faces away from `towards`.
static inline real3 turned(real3 n, const Surface *surface, real3 towards) {
    real3 aligned = choose(dot3(n, surface->ng) < 0.0f, negate(n), n);
    return choose(dot3(aligned, towards) > 0.0f, aligned, surface->ng);
}

// Turn all normals to the side of the unit vector `towards`; a shading normal that faces away from it is replaced.
static inline void turn_towards(Surface *surface, real3 towards) {
    surface->front = !(dot3(surface->ng, towards) < 0.0f);
    surface->ng = choose(surface->front, surface->ng, negate(surface->ng));
    surface->ns = turned(surface->ns, surface, towards);
    surface->cos_o = dot3(surface->ns, towards);
#if ANISOTROPY
    surface->towards = towards;
#endif
#if NORMAL_MAPS
    surface->unbent = turned(surface->unbent, surface, towards);
#endif
#if COAT_NORMALS
    surface->coat_normal = turned(surface->coat_normal, surface, towards);
    surface->coat_cos_o = dot3(surface->coat_normal, towards);
#endif
}

#include OFFSET
