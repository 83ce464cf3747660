// How far surfaces stop light; OPACITY_TYPES lists the types of materials some of which do not stop all of it.
#include "bsdf/interface.cl"

// What part of light along `direction` the surfaces stop, before they are turned (turn_towards).
static inline real opacity_at(const Scene *scene, const Surface *surface, real3 direction) {
    real opacity = ONE, cutoff = ZERO;     // other materials stop all light, whatever the alpha of vertex colours is
    ireal visible = ALL_LANES, from_behind = dot3(surface->ng, direction) > 0.0f;
#define OPACITY_OF(name, number) { \
        ireal is_type = (surface->material & 15) == number; \
        ireal index = is_type ? surface->material >> 4 : (ireal)(0); \
        if (ANY(is_type)) { \
            opacity = is_type ? PARAMETER(name, opacity) : opacity; \
            cutoff = is_type ? PARAMETER(name, cutoff) : cutoff; \
            visible = visible & !(is_type & from_behind & (PARAMETER(name, one_sided) != 0.0f)); \
        } \
    }
    OPACITY_TYPES(OPACITY_OF)
#if VERTEX_COLORS
    opacity *= surface->tint_opacity;
#endif
    opacity = cutoff < 0.0f ? opacity : (opacity < cutoff ? ZERO : ONE);
    return visible ? opacity : ZERO;
}
