"""Writing of images larger than memory, in blocks of rows from top to bottom."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .atomic_files import replacing
from .file_formats import EncodedFormat, format_of
from .images import UNASSOCIATED, check_writable, rgbe_rounded, write_levels
from .truncation import check_whole
from .view_transform import check_view, transparent_levels

#: Rows that an .exr compresses together; the rows of every piece but the last must be a multiple of this.
BLOCK_ROWS = 16


def write_rows(
    path: Path,
    size: tuple[int, int],
    pieces: Iterable[NDArray[np.float32]],
    *,
    channels: int = 3,
    metadata: Mapping[str, str] | None = None,
    view: str = "srgb",
    exposure: float = 0.0,
) -> None:
    """Write an image of size (width, height) from consecutive pieces (rows, width, `channels`), as `write_image` would,
    atomically. The rows of all pieces but the last are a multiple of BLOCK_ROWS. Raises OutputError."""
    import OpenImageIO as oiio

    check_writable(path)
    check_view(view, exposure)
    kind, (width, height) = format_of(path), size
    if isinstance(kind, EncodedFormat):  # encoded in memory
        levels = [_samples(piece[..., : 3 + kind.alpha], path, view, exposure) for piece in pieces]
        return write_levels(path, np.concatenate(levels), metadata or {})
    if channels == 4 and not kind.alpha:
        pieces, channels = (piece[..., :3] for piece in pieces), 3
    spec = oiio.ImageSpec(width, height, channels, np.dtype(kind.levels).name if kind.levels else "float")
    for name, value in kind.header(metadata or {}).items():
        spec.attribute(name, value)
    if channels == 4 and kind.levels:
        spec.attribute(UNASSOCIATED, 1)
    row = 0
    with replacing(path) as temporary:
        output = oiio.ImageOutput.create(str(temporary))
        if output is None or not output.open(str(temporary), spec):
            raise OSError((output or oiio).geterror() or "the writer gave no reason")
        for piece in pieces:
            samples = _samples(piece, path, view, exposure)
            if not output.write_scanlines(row, row + len(samples), 0, samples):
                break
            row += len(samples)
        closed, complaint = output.close(), output.geterror()
        if complaint or not closed:
            raise OSError(complaint.splitlines()[0] if complaint else "the writer gave no reason")
        if row != height:
            raise OSError(f"only {row} of its {height} rows were written")
        check_whole(temporary)


def _samples(piece: NDArray[np.float32], path: Path, view: str, exposure: float) -> NDArray[Any]:
    """Return the piece as samples for this file."""
    if levels := format_of(path).levels:
        return transparent_levels(piece, view, exposure, levels)
    return np.ascontiguousarray(rgbe_rounded(piece) if path.suffix.lower() == ".hdr" else piece)
