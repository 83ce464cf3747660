// What the kernels of this folder share: a work-item goes through its block of the vectors (see device/blocks.py).
#include "lanes.cl"

#define FOR_BLOCK(i) \
    for (uint i = (uint)get_global_id(0) * block, end = i + block < count ? i + block : count; i < end; ++i)
