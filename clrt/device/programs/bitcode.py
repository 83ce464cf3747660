"""Build PoCL programs from cached LLVM bitcode instead of source.

PoCL caches the bitcode (program.bc) that its front end makes, but looks it up by the preprocessed source: three
quarters of the time to load a program from PoCL's cache, and a compiler's memory. PoCL 3.0, the version that pip
installs, also accepts bitcode as a program binary. (Querying a program's binary compiles every kernel once more, for
any group size; 3.1 crashes when it compiles a kernel of such bitcode.) But it then distinguishes kernels by name alone,
across all cached programs, so kernel names end with the program's key. Its bitcode is found by that key, too.
"""

from __future__ import annotations

import heapq
import re
from contextlib import suppress
from pathlib import Path

from ..pocl.kernel_cache import kept_programs

#: How many of the programs that PoCL used last are searched: other processes build, too.
SEARCHED = 16
_KERNEL = re.compile(r"\bkernel void (\w+)\(")


def takes_bitcode(platform_version: str) -> bool:
    """Return whether the platform is the version of PoCL that is known to accept bitcode."""
    return "PoCL 3.0" in platform_version


def name_kernels(source: str, ending: str) -> str:
    """Return the source with `ending` appended to the names of its kernels."""
    return _KERNEL.sub(rf"kernel void \1{ending}(", source)


def find_bitcode(ending: str) -> bytes | None:
    """Return the bitcode of the program just built whose kernel names end with `ending`, or None if it is not found."""
    with suppress(OSError, RuntimeError):  # the folder may be unreadable, or there may be no home
        for used in heapq.nlargest(SEARCHED, kept_programs().glob("[A-Z][A-Z]/*/last_accessed"), _when):
            bitcode = used.with_name("program.bc").read_bytes()
            if ending.encode() in bitcode:  # symbols are plain bytes
                return bitcode
    return None


def _when(file: Path) -> int:
    return file.stat().st_mtime_ns
