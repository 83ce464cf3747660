// Sun with a disc: constant radiance within a small angle of `towards`, none outside. World frame.
//
// Directions are uniform in the cone (Shirley et al. 1996). The angle is stored as 1 − cos, and 1 − wi·towards is
// computed from the difference of the two vectors, whose square is twice that, so that a disc of 1e-3 degrees keeps its
// precision.
#include "light/interface.cl"

static inline LightSample sun_light_sample(const Scene *scene, ireal index, real3 p, real2 u) {
    real height = GATHER(real, scene->sun_lights, index, .height);
    LightSample s;
    s.wi = s.target = to_world(frame_around(GATHER3(scene->sun_lights, index, .towards)), sample_cone(u, height));
    s.radiance = GATHER3(scene->sun_lights, index, .radiance);
    s.pdf = cone_pdf(height);
    s.infinite = ALL_LANES;
    s.delta = NO_LANES;
    return s;
}

// Radiance along wi from one sun, and the pdf with which light sampling would sample wi.
static inline real3 sun_radiance(const Scene *scene, int sun, real3 wi, real *pdf) {
    ireal index = (ireal)(sun);
    real height = GATHER(real, scene->sun_lights, index, .height);
    real3 off_axis = sub(wi, GATHER3(scene->sun_lights, index, .towards));
    ireal inside = 0.5f * dot3(off_axis, off_axis) <= height;
    *pdf = inside ? cone_pdf(height) : ZERO;
    return choose(inside, GATHER3(scene->sun_lights, index, .radiance), splat(ZERO));
}
