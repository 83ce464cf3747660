// Brushed surfaces: GGX microfacets with two alphas, along and across the surface's tangent.
//
// Microfacets of two alphas are those of their geometric mean, stretched: Lambda(w) is that of the stretched w, D(h) that
// of the squeezed h.

// x, y: the tangent in the local frame, of unit length; stretch: √(alpha along it over alpha across it), 1 without one.
typedef struct { real x, y, stretch; } Brush;

static inline Brush brush_at(const Surface *surface, real along, real across) {
    real3 n = choose(surface->front, surface->ns, negate(surface->ns));     // as before it was turned to the viewer
    real3 t = to_local(frame_around(surface->ns), sub(surface->tangent, scale(n, dot3(surface->tangent, n))));
    real length2 = t.x * t.x + t.y * t.y;
    ireal known = (surface->handedness != 0.0f) & (length2 > 0.0f);
    real inverse = rsqrt(known ? length2 : ONE);
    return (Brush){known ? t.x * inverse : ONE, known ? t.y * inverse : ZERO, known ? sqrt(along / across) : ONE};
}

// From the local frame to that of the tangent, and back.
static inline real3 to_brush(const Brush *b, real3 w) {
    return vector(b->x * w.x + b->y * w.y, b->x * w.y - b->y * w.x, w.z);
}
static inline real3 from_brush(const Brush *b, real3 w) {
    return vector(b->x * w.x - b->y * w.y, b->x * w.y + b->y * w.x, w.z);
}
static inline real3 stretch(const Brush *b, real3 w) { return vector(w.x * b->stretch, w.y / b->stretch, w.z); }
static inline real3 squeeze(const Brush *b, real3 h) { return vector(h.x / b->stretch, h.y * b->stretch, h.z); }
