// Memory access as in the other kernels: vectors at any float alignment, atomics on shared numbers, and work-group
// scans.
#include "build/scan.cl"
#include "check/rows.cl"

// Copy 17 floats for each i, by ones, threes, fours and eights: mostly at addresses that are not multiples of their
// size.
kernel void move(uint count, uint block, global const float *in, global float *out) {
    FOR_BLOCK(i) {
        global const float *from = in + 17 * i;
        global float *to = out + 17 * i;
        vstore3(vload3(0, from), 0, to);
        to[3] = from[3];
        vstore4(vload4(1, from), 1, to);
        vstore8(vload8(1, from), 1, to);
        to[16] = from[16];
    }
}

// Count the numbers modulo `places`, and find the largest of each.
kernel void share(uint count, uint block, global const uint *in, uint places, global uint *counts, global uint *largest) {
    FOR_BLOCK(i) {
        atomic_inc(counts + in[i] % places);
        atomic_max(largest + in[i] % places, in[i]);
    }
}
