// How far surfaces stop light; OPACITY_TYPES lists the types of materials some of which do not stop all of it.
#include "bsdf/interface.cl"

#if CAMERA_CULLING
#define ONE_SIDED(value) ((value) >= (from_camera ? 0.5f : 1.0f))   // see Material.surface_parameters
#else
#define ONE_SIDED(value) ((value) != 0.0f)
#endif

// What part of light along `direction` the surfaces stop, before they are turned (turn_towards). from_camera: whether that
// is a camera ray, to which some have no back.
static inline real opacity_at(const Scene *scene, const Surface *surface, real3 direction, int from_camera) {
    real opacity = ONE, cutoff = ZERO;     // other materials stop all light, whatever the alpha of vertex colours is
    ireal visible = ALL_LANES, from_behind = dot3(surface->ng, direction) > 0.0f;
#define OPACITY_OF(name, number) { \
        ireal is_type = (surface->material & 15) == number; \
        ireal index = is_type ? surface->material >> 4 : (ireal)(0); \
        if (ANY(is_type)) { \
            opacity = is_type ? PARAMETER(name, opacity) : opacity; \
            cutoff = is_type ? PARAMETER(name, cutoff) : cutoff; \
            visible = visible & !(is_type & from_behind & ONE_SIDED(PARAMETER(name, one_sided))); \
        } \
    }
    OPACITY_TYPES(OPACITY_OF)
#if VERTEX_COLORS
    opacity *= surface->tint_opacity;
#endif
    opacity = cutoff < 0.0f ? opacity : (opacity < cutoff ? ZERO : ONE);
    return visible ? opacity : ZERO;
}
