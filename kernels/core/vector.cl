// Arithmetic on reals and vectors of three reals. min, max and abs are spelled out because some CPU drivers turn the
// built-in functions into calls; if an operand is NaN, the second operand is returned.
#include "core/lanes.cl"

#define PI 3.14159265358979f
#define BELOW_ONE ((real)(0.99999994f))                                     // the largest float that is
#define UNIT_ROUNDOFF 5.9604645e-8f                                        // 2^-24
#define GAMMA(n) ((n) * UNIT_ROUNDOFF / (1.0f - (n) * UNIT_ROUNDOFF))      // Higham 2002, lemma 3.1

static inline real minimum(real a, real b) { return a < b ? a : b; }
static inline real maximum(real a, real b) { return a > b ? a : b; }
static inline real absolute(real a) { return AS_REAL(AS_INT(a) & 0x7fffffff); }
static inline real square(real a) { return a * a; }
static inline real safe_sqrt(real a) { return sqrt(maximum(a, ZERO)); }

static inline real3 vector(real x, real y, real z) { return (real3){x, y, z}; }
static inline real3 splat(real a) { return (real3){a, a, a}; }
static inline real3 broadcast(const float *a) { return (real3){(real)(a[0]), (real)(a[1]), (real)(a[2])}; }
static inline real3 add(real3 a, real3 b) { return (real3){a.x + b.x, a.y + b.y, a.z + b.z}; }
static inline real3 sub(real3 a, real3 b) { return (real3){a.x - b.x, a.y - b.y, a.z - b.z}; }
static inline real3 mul(real3 a, real3 b) { return (real3){a.x * b.x, a.y * b.y, a.z * b.z}; }
static inline real3 scale(real3 a, real s) { return (real3){a.x * s, a.y * s, a.z * s}; }
static inline real3 mad3(real3 a, real s, real3 b) { return (real3){a.x * s + b.x, a.y * s + b.y, a.z * s + b.z}; }
static inline real3 negate(real3 a) { return (real3){-a.x, -a.y, -a.z}; }
static inline real3 absolute3(real3 a) { return (real3){absolute(a.x), absolute(a.y), absolute(a.z)}; }
static inline real dot3(real3 a, real3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline real3 cross3(real3 a, real3 b) {
    return (real3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static inline real length3(real3 a) { return sqrt(dot3(a, a)); }
static inline real3 normalize3(real3 a) { return scale(a, 1.0f / length3(a)); }
static inline real3 choose(ireal mask, real3 a, real3 b) {
    return (real3){mask ? a.x : b.x, mask ? a.y : b.y, mask ? a.z : b.z};
}
static inline real largest(real3 a) { return maximum(a.x, maximum(a.y, a.z)); }
static inline real luminance(real3 a) { return 0.2126f * a.x + 0.7152f * a.y + 0.0722f * a.z; }
// True for NaN, so that it reaches the film, which counts it, instead of being hidden.
static inline ireal carries_light(real3 a) { return !(a.x <= 0.0f) | !(a.y <= 0.0f) | !(a.z <= 0.0f); }

// A right-handed frame (s, t, n) around a unit normal (Duff et al. 2017, "Building an Orthonormal Basis, Revisited").
typedef struct { real3 s, t, n; } Frame;

static inline Frame frame_around(real3 n) {
    real sign = n.z < 0.0f ? (real)(-1.0f) : ONE;
    real a = -1.0f / (sign + n.z);
    real b = n.x * n.y * a;
    return (Frame){vector(1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x), vector(b, sign + n.y * n.y * a, -n.y), n};
}
static inline real3 to_local(Frame frame, real3 w) { return vector(dot3(w, frame.s), dot3(w, frame.t), dot3(w, frame.n)); }
static inline real3 to_world(Frame frame, real3 w) {
    return mad3(frame.s, w.x, mad3(frame.t, w.y, scale(frame.n, w.z)));
}
