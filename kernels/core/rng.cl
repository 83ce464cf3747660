// Random bits as a hash of four words, so that results do not depend on tiling, order or device.
//
// The hash is pcg4d (Jarzynski and Olano 2020, "Hash Functions for GPU Rendering", JCGT 9(3)). Its first output word is
// the weakest: its values for inputs 2^29 apart are correlated, so the others are used first.
#include "core/lanes.cl"

static inline real unit_interval(ureal bits) { return TO_REAL(bits >> 8) * 5.9604645e-8f; }  // [0, 1), 24 bits

static inline ureal4 hash4(ureal x, ureal y, ureal z, ureal w) {
    x = x * 1664525u + 1013904223u;
    y = y * 1664525u + 1013904223u;
    z = z * 1664525u + 1013904223u;
    w = w * 1664525u + 1013904223u;
    x += y * w; y += z * x; z += x * y; w += y * z;
    x ^= x >> 16; y ^= y >> 16; z ^= z >> 16; w ^= w >> 16;
    x += y * w; y += z * x; z += x * y; w += y * z;
    return (ureal4){x, y, z, w};
}
