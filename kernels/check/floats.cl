// Single float operations that the other kernels rely on, for the host to compare with exact results.
//
// The host numbers the rows (ROW_…): row r of vector i is out[r·count + i]; floats as their bits, masks as they are.
#include "check/rows.cl"
#include "core/vector.cl"

#define REAL(row, value) out[ROW_##row * count + i] = AS_INT(value);
#define MASK(row, value) out[ROW_##row * count + i] = value;

// in: a, b, c
kernel void floats(uint count, uint block, global const real *in, global ireal *out) {
    FOR_BLOCK(i) {
        real a = in[i], b = in[count + i], c = in[2 * count + i];
        REAL(sum, a + b)
        REAL(difference, a - b)
        REAL(product, a * b)
        REAL(contraction, a * b + c)
        REAL(fma, fma(a, b, c))
        REAL(quotient, a / b)
        REAL(reciprocal, 1.0f / a)
        REAL(sqrt, sqrt(a))
        REAL(rsqrt, rsqrt(a))
        REAL(atan2, atan2(a, b))
        REAL(exp, exp(16.0f * c))
        REAL(mix, mix(a, b, c))
        REAL(neighbour, nextafter(a, b))
        REAL(floor, floor(a))
        REAL(ceil, ceil(a))
        REAL(copysign, copysign(a, b))
        REAL(fabs, fabs(a))
        REAL(absolute, absolute(a))
        REAL(minimum, minimum(a, b))
        REAL(maximum, maximum(a, b))
        REAL(fmin, fmin(a, b))
        REAL(fmax, fmax(a, b))
        REAL(chosen, a < b ? a : c)
        MASK(less, a < b)
        MASK(less_equal, a <= b)
        MASK(greater, a > b)
        MASK(greater_equal, a >= b)
        MASK(equal, a == b)
        MASK(unequal, a != b)
        MASK(not_less, !(a < b))
        MASK(to_int, TO_INT(a))
        MASK(to_uint, AS_INT(TO_UINT(absolute(a))))
    }
}
