"""Find and remove damaged programs in PoCL's cache.

If one is damaged (the disk was full, the machine lost power), PoCL aborts the whole process, or returns a program
without kernels, every time.
"""

from __future__ import annotations

import os
import shutil
import struct
from contextlib import suppress
from itertools import chain
from pathlib import Path

#: Magic number of LLVM bitcode.
BITCODE = b"BC\xc0\xde"


def kept_programs() -> Path:
    """Return PoCL's cache folder.

    It has folders of two letters, with one folder per program in each, and next to them one folder per kernel of the
    programs that were built from bitcode (see bitcode.py).
    """
    if folder := os.environ.get("POCL_CACHE_DIR"):
        return Path(folder)
    cache = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(cache) / "pocl" / "kcache"


def remove_damaged() -> int:
    """Remove damaged programs, which are then compiled again when needed; return how many there were."""
    removed = 0
    with suppress(OSError, RuntimeError):  # the folder may be unreadable, or there may be no home
        for program in chain(kept_programs().glob("[A-Z][A-Z]/*"), kept_programs().glob("*_*")):
            if not all(map(_is_whole, program.rglob("*"))):
                shutil.rmtree(program, ignore_errors=True)
                removed += 1
    return removed


def _is_whole(file: Path) -> bool:
    """Return whether a file has the format that its name implies."""
    if file.suffix == ".bc":
        with open(file, "rb") as opened:
            return opened.read(len(BITCODE)) == BITCODE
    return file.suffix != ".so" or _is_whole_library(file)


def _is_whole_library(file: Path) -> bool:
    """Return whether an ELF file extends to the end of its section header table (System V ABI, ELF-64 header)."""
    with open(file, "rb") as opened:
        header = opened.read(64)
    if len(header) < 64 or header[:4] != b"\x7fELF":
        return False
    table: int = struct.unpack_from("<Q", header, 40)[0]
    entry, count = struct.unpack_from("<HH", header, 58)
    return bool(file.stat().st_size >= table + entry * count)
