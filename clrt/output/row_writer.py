"""Writing of images larger than memory, in blocks of rows from top to bottom."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .atomic_files import replacing
from .images import ATTRIBUTES, check_writable, rgbe_rounded
from .truncation import check_whole
from .view_transform import check_view, to_display

#: Rows that an .exr compresses together; the rows of every piece but the last must be a multiple of this.
BLOCK_ROWS = 16


def write_rows(
    path: Path,
    size: tuple[int, int],
    pieces: Iterable[NDArray[np.float32]],
    *,
    metadata: Mapping[str, str] | None = None,
    view: str = "srgb",
    exposure: float = 0.0,
) -> None:
    """Write an image of size (width, height) from consecutive pieces (rows, width, 3), as `write_image` would,
    atomically. The rows of all pieces but the last are a multiple of BLOCK_ROWS. Raises OutputError."""
    import OpenImageIO as oiio

    check_writable(path)
    check_view(view, exposure)
    kind, (width, height) = path.suffix.lower(), size
    spec = oiio.ImageSpec(width, height, 3, "uint8" if kind == ".png" else "float")
    for name, value in {**(metadata or {}), **ATTRIBUTES.get(kind, {})}.items():
        spec.attribute(name, value)
    row = 0
    with replacing(path) as temporary:
        output = oiio.ImageOutput.create(str(temporary))
        if output is None or not output.open(str(temporary), spec):
            raise OSError((output or oiio).geterror() or "the writer gave no reason")
        for piece in pieces:
            samples = _samples(piece, kind, view, exposure)
            if not output.write_scanlines(row, row + len(samples), 0, samples):
                break
            row += len(samples)
        closed, complaint = output.close(), output.geterror()
        if complaint or not closed:
            raise OSError(complaint.splitlines()[0] if complaint else "the writer gave no reason")
        if row != height:
            raise OSError(f"only {row} of its {height} rows were written")
        check_whole(temporary)


def _samples(piece: NDArray[np.float32], kind: str, view: str, exposure: float) -> NDArray[Any]:
    """Return the piece as samples for this file format."""
    if kind == ".png":
        return to_display(piece, view, exposure)
    return np.ascontiguousarray(rgbe_rounded(piece) if kind == ".hdr" else piece)
