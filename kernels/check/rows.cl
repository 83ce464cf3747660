// Shared by the kernels of this folder: a work-item processes its block of the vectors (see
// device/launches/data_parallel.py).
#include "core/lanes.cl"

#define FOR_BLOCK(i) \
    for (uint i = (uint)get_global_id(0) * block, end = i + block < count ? i + block : count; i < end; ++i)
