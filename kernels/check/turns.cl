// Numbers after `turns` iterations of a loop, from which the host infers how many were executed.
kernel void turns(global const uint *in, uint turns, global uint *out) {
    uint a = in[get_global_id(0)];
    for (uint k = 0; k < turns; ++k) a = a * 1664525u + 1013904223u;
    out[get_global_id(0)] = a;
}
