// Single integer operations that the other kernels rely on, for the host to compare with exact results.
//
// The host numbers the rows (ROW_…): row r of vector i is out[r·count + i].
#include "check/rows.cl"

#define INT(row, value) out[ROW_##row * count + i] = AS_INT(value);

// in: a, b; b > 0
kernel void integers(uint count, uint block, global const ureal *in, global ireal *out) {
    FOR_BLOCK(i) {
        ureal a = in[i], b = in[count + i], bits = b & 31;
        INT(sum, a + b)
        INT(difference, a - b)
        INT(product, a * b)
        INT(high_product, mul_hi(a, b))
        INT(quotient, a / b)
        INT(remainder, a % b)
        INT(left, a << bits)
        INT(right, a >> bits)
        INT(signed_right, AS_INT(a) >> AS_INT(bits))
        INT(exclusive_or, a ^ b)
        INT(inverse, ~a)
        INT(negative, -a)
        INT(ones, popcount(a))
        INT(zeros_in_front, clz(a))
        INT(less, a < b)
        INT(signed_less, AS_INT(a) < AS_INT(b))
        INT(to_float, TO_REAL(a))
        INT(signed_to_float, TO_REAL(AS_INT(a)))
    }
}

