"""Huge memory pages for the buffers of CPU devices, so that who first writes to them meets few page faults."""

from __future__ import annotations

import ctypes
import mmap

import numpy as np
import pyopencl as cl

PAGE = mmap.PAGESIZE
#: Smaller buffers are not worth it: huge pages have 2 MB.
WORTH = 1 << 22


def advise_huge_pages(queue: cl.CommandQueue, buffer: cl.Buffer) -> None:
    """Asks Linux to back the memory of a buffer that was just made with huge pages; elsewhere does nothing.

    Mapping a buffer of a CPU device gives the address of its memory, none of which is touched. It is only advice.
    """
    if not hasattr(mmap, "MADV_HUGEPAGE") or buffer.size < WORTH:
        return
    access = cl.map_flags.WRITE_INVALIDATE_REGION
    memory, _ = cl.enqueue_map_buffer(queue, buffer, access, 0, (buffer.size,), np.dtype(np.uint8))
    first, end = -(-memory.ctypes.data // PAGE) * PAGE, (memory.ctypes.data + buffer.size) // PAGE * PAGE
    ctypes.CDLL(None).madvise(ctypes.c_void_p(first), ctypes.c_size_t(end - first), mmap.MADV_HUGEPAGE)
    memory.base.release(queue)
