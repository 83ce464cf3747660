// Numbers after so many turns of a loop, from which the host tells how many there were.
kernel void turns(global const uint *in, uint turns, global uint *out) {
    uint a = in[get_global_id(0)];
    for (uint k = 0; k < turns; ++k) a = a * 1664525u + 1013904223u;
    out[get_global_id(0)] = a;
}
