"""Location of the kernel files, and a digest of them all."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path


def kernel_folder() -> Traversable:
    """Return the installed package clrt.kernels, or the folder next to clrt in a source tree."""
    try:
        return files("clrt.kernels")
    except ModuleNotFoundError:
        return Path(__file__).parents[3] / "kernels"


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
