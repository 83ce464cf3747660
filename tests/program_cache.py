"""Bounds the cache of compiled programs that PoCL keeps between test runs."""

from __future__ import annotations

import shutil
from itertools import chain
from pathlib import Path


def remove_oldest(folder: Path, most_bytes: int) -> None:
    """Delete the least recently used programs and kernels in a PoCL cache until the rest take at most `most_bytes`.

    Call it only while no process compiles: PoCL expects files that it has opened to stay. File systems update access
    times only to about a day, which is enough to recognize old versions of kernels.
    """
    kept = []
    for entry in chain(folder.glob("[A-Z][A-Z]/*"), folder.glob("*_*")):
        files = [file.stat() for file in entry.rglob("*") if file.is_file()]
        kept.append((max((file.st_atime for file in files), default=0.0), sum(file.st_size for file in files), entry))
    excess = sum(size for _, size, _ in kept) - most_bytes
    for _, size, entry in sorted(kept):
        if excess <= 0:
            break
        shutil.rmtree(entry, ignore_errors=True)
        excess -= size
