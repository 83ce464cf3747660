"""Direct I/O for large files: writing that bypasses the system's page cache, where supported.

Data that is written once and seldom read does not need the page cache: allocating its pages takes longer than a fast
disk needs for writing, and evicts the data of other programs.
"""

from __future__ import annotations

import errno
import mmap
import os
from collections.abc import Iterable, Iterator

#: Bytes per write: a multiple of every disk's block size, and some milliseconds of a fast disk.
CHUNK = 4 << 20


def write_past_cache(handle: int, pieces: Iterable[bytes | memoryview]) -> None:
    """Write the pieces of bytes one after another to an open file, positioned at its beginning. Raises OSError if that
    fails; the data is on disk only after `os.fsync`."""
    direct = _set_direct(handle, True)
    with mmap.mmap(-1, CHUNK) as memory, memoryview(memory) as chunk:  # page-aligned, as O_DIRECT requires
        for size in _filled(chunk, pieces):
            if direct and size < CHUNK:  # the last one
                direct = _set_direct(handle, False)
            done = 0
            while done < size:
                try:
                    done += os.write(handle, chunk[done:size])
                except OSError as error:
                    if not direct or error.errno != errno.EINVAL:
                        raise
                    direct = _set_direct(handle, False)  # some systems refuse only now


def _filled(chunk: memoryview, pieces: Iterable[bytes | memoryview]) -> Iterator[int]:
    """Yield the number of bytes in the chunk each time that it is full, and at the end of the pieces."""
    there = 0
    for piece in pieces:
        done = 0
        while done < len(piece):
            taken = min(CHUNK - there, len(piece) - done)
            chunk[there : there + taken] = memoryview(piece)[done : done + taken]
            done, there = done + taken, there + taken
            if there == CHUNK:
                yield there
                there = 0
    if there:
        yield there


def _set_direct(handle: int, wanted: bool) -> bool:
    """Switch direct I/O on or off; return whether it is on afterwards."""
    if not hasattr(os, "O_DIRECT"):
        return False
    import fcntl

    flags = fcntl.fcntl(handle, fcntl.F_GETFL)
    try:
        fcntl.fcntl(handle, fcntl.F_SETFL, flags | os.O_DIRECT if wanted else flags & ~os.O_DIRECT)
    except OSError:
        return False
    return wanted
