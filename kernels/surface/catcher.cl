// Catchers: surfaces that the image does not show, but what the objects change about their light. A scene with them is
// rendered twice, as it is and `bare`, with the same random numbers: then only catchers and emitters are there, of which
// the camera sees what it sees beside the objects. CATCHER_TYPES lists the material types of which some are catchers.
#include "bsdf/interface.cl"

static inline ireal is_catcher(const Scene *scene, const Surface *surface) {
    ireal catcher = NO_LANES;
#define CATCHER_OF(name, number) { \
        ireal is_type = (surface->material & 15) == number; \
        ireal index = is_type ? surface->material >> 4 : (ireal)(0); \
        if (ANY(is_type)) catcher = catcher | (is_type & (PARAMETER(name, catcher) != 0.0f)); \
    }
    CATCHER_TYPES(CATCHER_OF)
    return catcher;
}

// Whether a surface is there without the objects.
static inline ireal is_bare(const Scene *scene, const Surface *surface) {
    return is_catcher(scene, surface) | (surface->light >= 0);
}
