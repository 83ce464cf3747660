// Anisotropic GGX, as in glTF's KHR_materials_anisotropy: alpha_t = mix(alpha, 1, anisotropy²) along a direction on the
// surface, alpha_b = alpha across it.
//
// Such microfacets are those of alpha = √(alpha_t·alpha_b), stretched along one axis and squeezed along the other: with
// the symmetric matrix S of determinant 1 that scales the axes by √(alpha_t/alpha_b) and its inverse,
//   Lambda(w) is that of S·w,  D(h) that of S⁻¹·h,  and visible normals are those of S·wo, multiplied by S

// xx, xy, yy: of S. alpha_t, alpha_b: equal on isotropic surfaces.
typedef struct {
    real xx, xy, yy, alpha_t, alpha_b;
#if ANISOTROPY_ALBEDO
    const Scene *scene;
    ireal first;                // entry of the table (anisotropy_albedo.cl)
    real2 row;                  // where alpha_t and alpha_b lie among its rows
#endif
} Anisotropy;

static inline real3 stretched_by(const Anisotropy *a, real3 w) {
    return vector(a->xx * w.x + a->xy * w.y, a->xy * w.x + a->yy * w.y, w.z);
}
static inline real3 squeezed_by(const Anisotropy *a, real3 h) {
    return vector(a->yy * h.x - a->xy * h.y, a->xx * h.y - a->xy * h.x, h.z);
}

// The direction of alpha_t in the world: the tangent, rotated by the material; and whether the surface has tangents.
static inline real3 anisotropic_axis(const Scene *scene, ireal index, const Surface *surface, ireal *has_tangents) {
    real along = CONSTANT1(metallic_roughness, anisotropy_cos), across = CONSTANT1(metallic_roughness, anisotropy_sin);
#if ANISOTROPY_MAP
    ireal texture = GATHER(ireal, scene->metallic_roughness, index, .anisotropy_map_texture);
    ireal mapped = texture >= 0;
    if (ANY(mapped)) {
        Footprint found = footprint(scene, mapped ? texture : (ireal)(0), &surface->at);
        real x = 2.0f * filtered(&found, (ureal)(0)) - 1.0f, y = 2.0f * filtered(&found, (ureal)(8)) - 1.0f;
        real turned = along * x - across * y;
        across = mapped ? across * x + along * y : across;
        along = mapped ? turned : along;
    }
#endif
    real3 n = choose(surface->front, surface->ns, negate(surface->ns));     // as before it was turned to the viewer
    real3 t = sub(surface->tangent, scale(n, dot3(surface->tangent, n)));
    real length2 = dot3(t, t), size2 = along * along + across * across;
    *has_tangents = (surface->handedness != 0.0f) & (length2 > 0.0f) & (size2 > 1e-6f);
    t = scale(t, rsqrt(*has_tangents ? length2 * size2 : ONE));
    real side = surface->handedness < 0.0f ? (real)(-1.0f) : ONE;
    return mad3(t, along, scale(cross3(n, t), across * side));
}

// strength: from 0 to 1. axis: unit, in the frame of the normal.
static inline Anisotropy anisotropy_of(const Scene *scene, ireal index, real alpha, real strength, real3 axis) {
    Anisotropy a;
    a.alpha_b = alpha;
    a.alpha_t = alpha + (1.0f - alpha) * strength * strength;
    real along = sqrt(a.alpha_t / a.alpha_b), across = 1.0f / along;
    real size2 = axis.x * axis.x + axis.y * axis.y, inverse = size2 > 0.0f ? 1.0f / size2 : ZERO;
    real x2 = size2 > 0.0f ? axis.x * axis.x * inverse : ONE;
    a.xx = across + (along - across) * x2;
    a.yy = along - (along - across) * x2;
    a.xy = (along - across) * axis.x * axis.y * inverse;
#if ANISOTROPY_ALBEDO
    a.scene = scene;
    a.first = TO_INT(CONSTANT1(metallic_roughness, anisotropy_energy));
    real rows = CONSTANT1(metallic_roughness, anisotropy_last_row);
    a.row = (real2){rows * cbrt(a.alpha_t), rows * cbrt(a.alpha_b)};
#endif
    return a;
}

static inline ireal is_anisotropic(const Anisotropy *a) { return a->alpha_t > a->alpha_b; }
