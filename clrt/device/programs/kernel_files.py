"""Location of the kernel files, and a digest of them all."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path


def kernel_folder() -> Traversable:
    """Return the folder next to clrt in a source tree, wherever clrt is installed; else the package clrt.kernels."""
    beside = Path(__file__).parents[3] / "kernels"
    return beside if (beside / "core" / "lanes.cl").is_file() else files("clrt.kernels")


def kernel_digest() -> str:
    """Return the SHA-256 of the names and texts of all kernel files, as 64 hexadecimal digits."""
    digest = hashlib.sha256()
    for name, text in sorted(_kernel_files(kernel_folder(), "")):
        digest.update(f"{name}\0{len(text)}\0".encode() + text)
    return digest.hexdigest()


def _kernel_files(folder: Traversable, above: str) -> Iterator[tuple[str, bytes]]:
    for entry in folder.iterdir():
        if entry.is_dir():
            yield from _kernel_files(entry, f"{above}{entry.name}/")
        elif entry.name.endswith(".cl"):
            yield above + entry.name, entry.read_bytes()
