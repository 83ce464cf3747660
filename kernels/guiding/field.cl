// Path guiding: a field of directional distributions, learned from paths before the image is rendered, from which the
// directions of paths are sampled besides those from BSDFs (Müller, Gross and Novák 2017). World frame.
//
// A binary tree over positions and shading normals has a quadtree over directions in each of its leaves. Directions are
// points of the unit square, with areas in proportion to solid angles: (azimuth/2·pi, (1 + z)/2). A quadtree divides the
// square into quarters, each with its share of the square's probability; a quarter that is not divided further has a
// constant density.
#include "core/sampling.cl"

// The field at a point of a surface. quarters: the index of the root's first quarter; share: the share of directions sampled from
// the field; reflected: the mean luminance that surfaces here reflect, without that of light sampling.
typedef struct {
    ireal quarters;
    real share, reflected;
} Guiding;

static inline Guiding guiding_at(const Scene *scene, real3 p, real3 n) {
    ireal node = (ireal)(0), axis = GATHER(ireal, scene->spatial_nodes, node, .axis);
    for (ireal inner = axis >= 0; ANY(inner); inner = axis >= 0) {
        real position = axis == 0 ? p.x : axis == 1 ? p.y : p.z, normal = axis == 3 ? n.x : axis == 4 ? n.y : n.z;
        real place = axis < 3 ? position : normal;
        ireal above = place >= GATHER(real, scene->spatial_nodes, node, .value);
        ireal below = GATHER(ireal, scene->spatial_nodes, node, .child);
        node = inner ? (above ? below + 1 : below) : node;
        axis = GATHER(ireal, scene->spatial_nodes, node, .axis);
    }
    return (Guiding){GATHER(ireal, scene->spatial_nodes, node, .child),
                     GATHER(real, scene->spatial_nodes, node, .value),
                     GATHER(real, scene->spatial_nodes, node, .reflected)};
}

// The point of the unit square that stands for a direction, in [0, 1)².
static inline real2 square_of(real3 w) {
    real x = atan2(w.y, w.x) * (0.5f / PI), y = 0.5f + 0.5f * w.z;
    x = x < 0.0f ? x + 1.0f : x;
    return (real2){minimum(x, BELOW_ONE), minimum(maximum(y, ZERO), BELOW_ONE)};
}

// The index of one of four quarters from `first` on.
static inline ireal quarter_of(ireal first, ireal right, ireal upper) {
    return first + (right ? (ireal)(1) : (ireal)(0)) + (upper ? (ireal)(2) : (ireal)(0));
}

// The density of a direction, per solid angle.
static inline real guiding_pdf(const Scene *scene, const Guiding *guiding, real3 w) {
    real2 at = square_of(w);
    real density = (real)(0.25f / PI);
    ireal quarters = guiding->quarters;
    for (ireal inner = ALL_LANES; ANY(inner); inner = inner & (quarters >= 0)) {
        ireal right = at.x >= 0.5f, upper = at.y >= 0.5f;
        ireal quarter = quarter_of(inner ? quarters : (ireal)(0), right, upper);
        density *= inner ? 4.0f * GATHER(real, scene->quarters, quarter, .share) : ONE;
        at.x = 2.0f * at.x - (right ? ONE : ZERO);
        at.y = 2.0f * at.y - (upper ? ONE : ZERO);
        quarters = inner ? GATHER(ireal, scene->quarters, quarter, .quarters) : quarters;
    }
    return density;
}

// Choose one of two intervals of [0, 1), the first of length `first`; u is rescaled to the position in it.
static inline ireal second_of(real first, real *u) {
    ireal second = *u >= first;
    *u = second ? (*u - first) / (1.0f - first) : *u / first;
    *u = minimum(*u, BELOW_ONE);
    return second;
}

// Sample a direction; *pdf is set to its density.
static inline real3 guiding_sample(const Scene *scene, const Guiding *guiding, real2 u, real *pdf) {
    real density = (real)(0.25f / PI), size = ONE;
    real2 corner = {ZERO, ZERO}, left = u;
    ireal quarters = guiding->quarters;
    for (ireal inner = ALL_LANES; ANY(inner); inner = inner & (quarters >= 0)) {
        ireal first = inner ? quarters : (ireal)(0);
        real2 next = left;
        real lower_left = GATHER(real, scene->quarters, first, .share);
        real lower_right = GATHER(real, scene->quarters, first + 1, .share);
        real upper_left = GATHER(real, scene->quarters, first + 2, .share);
        real upper_right = GATHER(real, scene->quarters, first + 3, .share);
        ireal right = second_of(lower_left + upper_left, &next.x);
        real lower = right ? lower_right : lower_left, upper = right ? upper_right : upper_left;
        ireal above = second_of(lower / (lower + upper), &next.y);
        left.x = inner ? next.x : left.x;
        left.y = inner ? next.y : left.y;
        density *= inner ? 4.0f * (above ? upper : lower) : ONE;
        size = inner ? 0.5f * size : size;
        corner.x += inner & right ? size : ZERO;
        corner.y += inner & above ? size : ZERO;
        ireal quarter = quarter_of(first, right, above);
        quarters = inner ? GATHER(ireal, scene->quarters, quarter, .quarters) : quarters;
    }
    real sine, cosine, y = corner.y + size * left.y, radius = 2.0f * safe_sqrt(y * (1.0f - y));
    sincos_turns(corner.x + size * left.x, &sine, &cosine);
    *pdf = density;
    return vector(radius * cosine, radius * sine, 2.0f * y - 1.0f);
}
