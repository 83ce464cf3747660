// Surface opacity; OPACITY_TYPES lists the material types of which some are not opaque.
#include "bsdf/interface.cl"
#include CATCHER_FILE

#if CAMERA_CULLING
#define ONE_SIDED(value) ((value) >= (from_camera ? 0.5f : 1.0f))   // see Material.surface_parameters
#else
#define ONE_SIDED(value) ((value) != 0.0f)
#endif

#if CAMERA_HIDDEN
#define HIDDEN 2.0f            // added to the one_sided of surfaces that the camera does not see
#define SIDED(name) fmod(PARAMETER(name, one_sided), (real)(HIDDEN))
#define HIDE_FROM_CAMERA(name) if (from_camera) visible = visible & !(is_type & (PARAMETER(name, one_sided) >= HIDDEN));
#else
#define SIDED(name) PARAMETER(name, one_sided)
#define HIDE_FROM_CAMERA(name)
#endif

// Whether rays may pass the primitives at the hits: not if these are opaque whatever the direction. scene->opaque: 0 for
// primitives that need not be opaque, 1 for those that are to all rays but the camera's, 2 to all.
static inline ireal may_pass(const Scene *scene, const Hits *hits, int from_camera) {
    ireal opaque = GATHER(ireal, scene->opaque, stored_primitive(scene, hits), .rays);
    return (hits->primitive >= 0) & (opaque <= (from_camera ? 1 : 0));
}

// The opacity of surfaces for light along `direction`, before turn_towards. from_camera: whether the ray is a camera
// ray, to which some surfaces are invisible, or culled on their back side.
static inline real opacity_at(const Scene *scene, const Surface *surface, real3 direction, int from_camera) {
    real opacity = ONE, cutoff = ZERO;     // other materials are opaque, whatever the alpha of vertex colours
    ireal visible = ALL_LANES, from_behind = dot3(surface->ng, direction) > 0.0f;
#define OPACITY_OF(name, number) { \
        ireal is_type = (surface->material & 15) == number; \
        ireal index = is_type ? surface->material >> 4 : (ireal)(0); \
        if (ANY(is_type)) { \
            opacity = is_type ? PARAMETER(name, opacity) : opacity; \
            cutoff = is_type ? PARAMETER(name, cutoff) : cutoff; \
            visible = visible & !(is_type & from_behind & ONE_SIDED(SIDED(name))); \
            HIDE_FROM_CAMERA(name) \
        } \
    }
    OPACITY_TYPES(OPACITY_OF)
#if VERTEX_COLORS
    opacity *= surface->tint_opacity;
#endif
#if CATCHER
    if (scene->bare && !from_camera) visible = visible & is_bare(scene, surface);
#endif
    opacity = cutoff < 0.0f ? opacity : (opacity < cutoff ? ZERO : ONE);
    return visible ? opacity : ZERO;
}
