"""Programs that PoCL keeps. Where one is damaged (a disk that was full, a machine that lost power), PoCL ends the whole
process, or has a program without kernels, again and again: so these are found, and removed."""

from __future__ import annotations

import os
import shutil
import struct
from contextlib import suppress
from itertools import chain
from pathlib import Path

#: What LLVM's bitcode begins with.
BITCODE = b"BC\xc0\xde"


def kept_programs() -> Path:
    """The folder; in it are folders of two letters, in those one for each program, and beside them one for each kernel
    of those that were built of bitcode (see bitcode.py)."""
    if folder := os.environ.get("POCL_CACHE_DIR"):
        return Path(folder)
    cache = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(cache) / "pocl" / "kcache"


def remove_damaged() -> int:
    """How many programs were damaged; they are compiled again when they are needed."""
    removed = 0
    with suppress(OSError, RuntimeError):   # it may not be ours to read, and there may be no home
        for program in chain(kept_programs().glob("[A-Z][A-Z]/*"), kept_programs().glob("*_*")):
            if not all(map(_is_whole, program.rglob("*"))):
                shutil.rmtree(program, ignore_errors=True)
                removed += 1
    return removed


def _is_whole(file: Path) -> bool:
    """Whether it looks like what its name says."""
    if file.suffix == ".bc":
        with open(file, "rb") as opened:
            return opened.read(len(BITCODE)) == BITCODE
    return file.suffix != ".so" or _is_whole_library(file)


def _is_whole_library(file: Path) -> bool:
    """Whether an ELF file is as long as the table at its end asks for (System V ABI, ELF-64 header)."""
    with open(file, "rb") as opened:
        header = opened.read(64)
    if len(header) < 64 or header[:4] != b"\x7fELF":
        return False
    table: int = struct.unpack_from("<Q", header, 40)[0]
    entry, count = struct.unpack_from("<HH", header, 58)
    return bool(file.stat().st_size >= table + entry * count)
