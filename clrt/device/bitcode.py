"""What PoCL's front end makes of a source, LLVM's bitcode, to build a program from instead of the source.

PoCL keeps it (program.bc), but finds it by what its preprocessor makes of the source: three quarters of the time that a
program takes to come from PoCL's cache, and a compiler's memory. PoCL 3.0, the one that pip installs, takes bitcode as
a binary, too. (Asking for a program's binary compiles every kernel once more, for groups of any size; 3.1 crashes where
it compiles a kernel of such bitcode.) But it then tells kernels apart by their names alone, also from those of other
programs that are kept, so names end with the program's own key, by which its bitcode is found, too.
"""

from __future__ import annotations

import heapq
import re
from contextlib import suppress
from pathlib import Path

from .pocl_cache import kept_programs

#: So many of the programs that PoCL used last are searched: other processes build, too.
SEARCHED = 16
_KERNEL = re.compile(r"\bkernel void (\w+)\(")


def takes_bitcode(platform_version: str) -> bool:
    """Whether it is PoCL of the version that was seen to."""
    return "PoCL 3.0" in platform_version


def name_kernels(source: str, ending: str) -> str:
    """The source, whose kernels' names end so."""
    return _KERNEL.sub(rf"kernel void \1{ending}(", source)


def find_bitcode(ending: str) -> bytes | None:
    """That of the program which was just built, whose kernels' names end so; None where it is not found."""
    with suppress(OSError, RuntimeError):   # it may not be ours to read, and there may be no home
        for used in heapq.nlargest(SEARCHED, kept_programs().glob("[A-Z][A-Z]/*/last_accessed"), _when):
            bitcode = used.with_name("program.bc").read_bytes()
            if ending.encode() in bitcode:  # symbols are plain bytes
                return bitcode
    return None


def _when(file: Path) -> int:
    return file.stat().st_mtime_ns
