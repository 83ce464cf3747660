"""Return freed memory that the C library retains to the system. Does nothing with libraries other than glibc."""

from __future__ import annotations

import ctypes
from contextlib import suppress

#: Parameters of glibc's mallopt: the size from which allocations use mmap, and the maximum number of arenas.
MMAP_THRESHOLD, ARENA_MAX = -3, -8


def keep_less() -> None:
    """Have large allocations returned to the system when freed, and limit the threads to two arenas.

    Otherwise glibc retains ever more memory for each thread that has allocated some.
    """
    with suppress(OSError, AttributeError, TypeError):
        ctypes.CDLL(None).mallopt(MMAP_THRESHOLD, 1 << 16)
        ctypes.CDLL(None).mallopt(ARENA_MAX, 2)


def give_back() -> None:
    """Return free memory, such as a compiler's, to the system (malloc_trim)."""
    with suppress(OSError, AttributeError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)
