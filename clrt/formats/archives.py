"""Checks of ZIP archives (.3mf, .usdz) by their directory, before any of their content is read."""

from __future__ import annotations

import zipfile
from pathlib import Path

from ..errors import SceneError

#: Bytes that any archive may unpack to; a larger one at most MOST_RATIO times its size, since text of numbers, such as
#: a mesh, is compressed to more than a hundredth; no archive may exceed MOST_BYTES.
FREE_BYTES = 2**26
MOST_RATIO = 100
MOST_BYTES = 2**31


def check_archive(path: Path, compressed: bool) -> None:
    """Raise SceneError unless the file is a ZIP archive that unpacks to a size in proportion to its own.

    compressed: whether its files may be compressed.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            entries = archive.infolist()
    except (zipfile.BadZipFile, NotImplementedError, ValueError, OSError) as error:
        raise SceneError(f"is not a ZIP archive, or a damaged one ({error}); export it again") from None
    stored = path.stat().st_size
    for entry in entries:
        if entry.flag_bits & 1:
            raise SceneError(f'its file "{entry.filename}" is encrypted; export it without encryption')
        if not compressed and entry.compress_type != zipfile.ZIP_STORED:
            raise SceneError(f'its file "{entry.filename}" is compressed; pack it without compression (zip -0)')
    unpacked = sum(entry.file_size for entry in entries)
    most = min(MOST_BYTES, max(FREE_BYTES, MOST_RATIO * stored)) if compressed else stored
    if unpacked > most or sum(entry.compress_size for entry in entries) > stored:
        raise SceneError(f"its {stored} bytes cannot contain {unpacked} bytes of files; export it again")
