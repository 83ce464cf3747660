// The horizon of the geometric surface. Lobes lie around a shading normal, bent by a map or interpolated, and send a part of
// their light to the wrong side of the surface, where a ray would enter what is solid. The gloss in that part is mirrored at
// the geometric surface, as by a flat surface below, so that value and density remain those of one function and no energy
// is lost:
//
//   value(wi) = f(wi) + gloss(mirrored wi)     above the surface; of what is transmitted, below it
//
// The mirrored view is continuous where it crosses this horizon, and where the view crosses the shading horizon, beyond which
// the geometric normal replaces the shading normal (surface.cl).
//
// Matte light is not folded, as in other renderers: Lambert's law around the shading normal loses (1 − cos θ)/2 to below the
// surface, θ the angle between both normals. Mirrored, it would be twice as bright at the horizon, a hard edge where a light
// sets (docs/accuracy.md). Below bumps of normal maps it fades out towards the horizon (bump_shadowing in normal_maps.cl).
//
// Local frame of the shading normal, as in bsdf/interface.cl. `side`: the cosine of a direction with the geometric normal.

static inline real3 mirrored_at(real3 ng, real3 w, real side) { return mad3(ng, -2.0f * side, w); }

// Whether light scattered to w, whatever side of the geometric surface that is on, belongs to the side of the cosine `side`.
static inline ireal ends_on_side(real3 w, real side) {
#if TRANSMISSION
    return same_side(w.z, side);
#else
    return (w.z > 0.0f) & (side > 0.0f);
#endif
}

// Adds the gloss that is folded to w, and the density of all that is.
static inline void add_folded(const Bsdf *bsdf, real3 ng, real3 wo, real3 w, real side, BsdfValue *at) {
    real3 mirrored = mirrored_at(ng, w, side);
    ireal folded = ends_on_side(mirrored, side);
    if (!ANY(folded)) return;
    BsdfValue other = bsdf_eval(bsdf, wo, mirrored);
    at->value = choose(folded, add(at->value, sub(other.value, other.matte)), at->value);
    at->pdf += folded ? other.pdf : ZERO;
}
