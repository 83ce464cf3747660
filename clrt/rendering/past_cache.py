"""Large files are written past the system's memory for files, where it allows that.

What is written once and seldom read needs none of that memory: to find it takes longer than a fast disk does to write,
and other programs would have to give theirs up.
"""

from __future__ import annotations

import errno
import mmap
import os
from collections.abc import Iterable, Iterator

#: Written at a time: a multiple of every disk's blocks, and some milliseconds of a fast one.
CHUNK = 4 << 20


def write_past_cache(handle: int, pieces: Iterable[bytes | memoryview]) -> None:
    """Writes the pieces, of bytes, one after another to an open file, which is at its beginning. OSError where that
    fails; not all of it is on disk before `os.fsync`."""
    direct = _set_direct(handle, True)
    with mmap.mmap(-1, CHUNK) as memory, memoryview(memory) as chunk:    # which begins with a page, as a disk wants it
        for size in _filled(chunk, pieces):
            if direct and size < CHUNK:    # the last one
                direct = _set_direct(handle, False)
            done = 0
            while done < size:
                try:
                    done += os.write(handle, chunk[done:size])
                except OSError as error:
                    if not direct or error.errno != errno.EINVAL:
                        raise
                    direct = _set_direct(handle, False)    # some systems only refuse now


def _filled(chunk: memoryview, pieces: Iterable[bytes | memoryview]) -> Iterator[int]:
    """How many bytes of the pieces are in the chunk, each time that it is full, and at the end."""
    there = 0
    for piece in pieces:
        done = 0
        while done < len(piece):
            taken = min(CHUNK - there, len(piece) - done)
            chunk[there:there + taken] = memoryview(piece)[done:done + taken]
            done, there = done + taken, there + taken
            if there == CHUNK:
                yield there
                there = 0
    if there:
        yield there


def _set_direct(handle: int, wanted: bool) -> bool:
    """Asks for writing past that memory, or for writing as usual; whether it will be past it."""
    if not hasattr(os, "O_DIRECT"):
        return False
    import fcntl

    flags = fcntl.fcntl(handle, fcntl.F_GETFL)
    try:
        fcntl.fcntl(handle, fcntl.F_SETFL, flags | os.O_DIRECT if wanted else flags & ~os.O_DIRECT)
    except OSError:
        return False
    return wanted
