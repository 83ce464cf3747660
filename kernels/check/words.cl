// Integers of eight and 64 bits, as used by masks, the space-filling curve and compressed nodes.
//
// The host numbers the rows (ROW_…): row r of item i is out[r·count + i].
#include "check/rows.cl"

#define WORD(row, value) out[ROW_##row * count + i] = value;

// in: a, b
kernel void words(uint count, uint block, global const uint *in, global uint *out) {
    FOR_BLOCK(i) {
        uint a = in[i], b = in[count + i];
        ulong wide = (ulong)a << 32 | b, product = wide * 0x0101010101010101UL;
        WORD(low_product, (uint)product)
        WORD(high_product, (uint)(product >> 32))
        WORD(low_shifted, (uint)(wide << 20))
        WORD(high_shifted, (uint)(wide >> 12))
        uint4 bytes = convert_uint4(as_uchar4(a)) << (convert_uint4(as_uchar4(b)) & 15);
        WORD(shifted_bytes, bytes.x + bytes.y + bytes.z + bytes.w)
        float4 quarters = convert_float4(as_uchar4(a)) * 0.25f;
        WORD(bytes_to_float, as_uint((quarters.x + quarters.y) + (quarters.z + quarters.w)))
        WORD(signed_byte, (uint)(int)(char)(a & 0xff))
        WORD(float_to_byte, (uint)(uchar)floor(as_float((a & 0x7fffff) | 0x42800000)))   // from 64 up to 128
    }
}
