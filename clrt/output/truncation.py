"""Completeness check of written image files: OpenImageIO does not report that the system refused the
last bytes, as on a full disk."""

from __future__ import annotations

import os
from pathlib import Path

#: The end of every .png: a chunk without data, and its checksum.
PNG_END = b"\0\0\0\0IEND\xaeB`\x82"


def check_whole(path: Path) -> None:
    """Raise OSError unless the image file at `path`, a UTF-8 name, is complete.

    Of all but .png the last row is read, which decodes one block of an .exr or .tif, but all of the others.
    """
    if not (_ends_as_png(path) if path.suffix == ".png" else _has_last_row(path)):
        raise OSError("its end is missing")


def _ends_as_png(path: Path) -> bool:
    with path.open("rb") as file:
        file.seek(max(0, os.fstat(file.fileno()).st_size - len(PNG_END)))
        return file.read() == PNG_END


def _has_last_row(path: Path) -> bool:
    import OpenImageIO as oiio

    opened = oiio.ImageInput.open(str(path))
    if opened is None:
        oiio.geterror()  # fetched, or it would be printed at exit
        return False
    row = opened.read_scanline(opened.spec().height - 1, 0, "float")
    return row is not None and not opened.geterror()
