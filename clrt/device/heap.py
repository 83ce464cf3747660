"""Memory that the C library keeps though it was freed, given back to the system. Libraries other than glibc have none
of this, and then nothing is done."""

from __future__ import annotations

import ctypes
from contextlib import suppress

#: glibc's mallopt: from how many bytes on memory is the system's own, and how many heaps there are for threads.
MMAP_THRESHOLD, ARENA_MAX = -3, -8


def keep_less() -> None:
    """From now on large arrays go back to the system once they are freed, and threads share two heaps: else ever more
    is kept for each thread that has had some."""
    with suppress(OSError, AttributeError, TypeError):
        ctypes.CDLL(None).mallopt(MMAP_THRESHOLD, 1 << 16)
        ctypes.CDLL(None).mallopt(ARENA_MAX, 2)


def give_back() -> None:
    """Gives back what is free now, such as what a compiler had (malloc_trim)."""
    with suppress(OSError, AttributeError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)
