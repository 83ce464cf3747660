"""Checks of ZIP archives (.3mf, .usdz) by their directory, before any of their content is read; gzip files."""

from __future__ import annotations

import zipfile
import zlib
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


def gunzipped(path: Path) -> bytes:
    """Return the content of a .gz file, which may unpack to FREE_BYTES, or to MOST_RATIO times its size up to
    MOST_BYTES. Raises SceneError naming the file."""
    stored = path.read_bytes()
    most = min(MOST_BYTES, max(FREE_BYTES, MOST_RATIO * len(stored)))
    unpacker = zlib.decompressobj(wbits=31)
    try:
        content = unpacker.decompress(stored, most + 1)
    except zlib.error as error:
        raise SceneError(f"{path}: is not a gzip file, or a damaged one ({error}); compress it again") from None
    if len(content) > most:
        raise SceneError(f"{path}: its {len(stored)} bytes unpack to more than {most} bytes; unpack it with gunzip")
    if not unpacker.eof:
        raise SceneError(f"{path}: is a gzip file that ends early; compress it again")
    return content
