// Horizon of the geometric surface. Lobes around a bent or interpolated shading normal scatter part of their light to
// the wrong side of the geometric surface, where a ray would enter a solid. The glossy part of that light is mirrored
// at the geometric surface, as by a flat surface below, so that value and pdf remain those of one function and no
// energy is lost:
//
//   value(wi) = f(wi) + gloss(mirrored wi)     above the surface; for transmitted light, below it
//
// The result is continuous as the view direction crosses the geometric horizon, and as it crosses the shading horizon,
// beyond which the geometric normal replaces the shading normal (surface/surface.cl).
//
// Diffuse light is not folded, as in other renderers: Lambert's law around the shading normal loses (1 − cos θ)/2 to
// below the surface, with θ the angle between both normals. Folding would double it at the horizon, a hard edge at the
// terminator (docs/accuracy.md). With normal maps it fades out towards the horizon (bump_shadowing in
// surface/normal_maps.cl).
//
// Local frame of the shading normal, as in bsdf/interface.cl. `side`: cosine of a direction with the geometric normal.

static inline real3 mirrored_at(real3 ng, real3 w, real side) { return mad3(ng, -2.0f * side, w); }

// Whether light scattered to w, on either side of the geometric surface, ends up on the side of the cosine `side`.
static inline ireal ends_on_side(real3 w, real side) {
#if TRANSMISSION
    return same_side(w.z, side);
#else
    return (w.z > 0.0f) & (side > 0.0f);
#endif
}

// Add the gloss that is folded to w, and the pdf of all light that is.
static inline void add_folded(const Bsdf *bsdf, real3 ng, real3 wo, real3 w, real side, BsdfValue *at) {
    real3 mirrored = mirrored_at(ng, w, side);
    ireal folded = ends_on_side(mirrored, side);
    if (!ANY(folded)) return;
    BsdfValue other = bsdf_eval(bsdf, wo, mirrored);
    at->value = choose(folded, add(at->value, sub(other.value, other.matte)), at->value);
    at->pdf += folded ? other.pdf : ZERO;
}
