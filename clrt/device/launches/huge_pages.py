"""Huge memory pages for the buffers of CPU devices, which reduce page faults at the first write."""

from __future__ import annotations

import ctypes
import mmap

import numpy as np
import pyopencl as cl

PAGE = mmap.PAGESIZE
#: Minimum buffer size: huge pages have 2 MB, and smaller buffers would not benefit.
WORTH = 1 << 22


def advise_huge_pages(queue: cl.CommandQueue, buffer: cl.Buffer) -> None:
    """Advise Linux to back a newly created buffer with huge pages; elsewhere do nothing.

    Mapping a buffer of a CPU device gives its address without touching the memory.
    """
    if not hasattr(mmap, "MADV_HUGEPAGE") or buffer.size < WORTH:
        return
    access = cl.map_flags.WRITE_INVALIDATE_REGION
    memory, _ = cl.enqueue_map_buffer(queue, buffer, access, 0, (buffer.size,), np.dtype(np.uint8))
    first, end = -(-memory.ctypes.data // PAGE) * PAGE, (memory.ctypes.data + buffer.size) // PAGE * PAGE
    ctypes.CDLL(None).madvise(ctypes.c_void_p(first), ctypes.c_size_t(end - first), mmap.MADV_HUGEPAGE)
    memory.base.release(queue)
