"""Mitsuba's compressed mesh files, .serialized: versions 3 and 4, with any number of meshes.

Each mesh is a header and a zlib stream of flags, a name (version 4), counts, and arrays; at the end of the file are the
offsets of all meshes and their number (Mitsuba 3's manual, "Serialized mesh loader").
"""

from __future__ import annotations

import struct
import zlib
from io import BufferedReader
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from ...scene.model import Mesh
from ..referenced_files import check_file, name_of

MAGIC, HEADER = 0x041C, 4
NORMALS, UV, COLORS, FLAT, DOUBLE = 1, 2, 8, 16, 0x2000
#: Meshes of more bytes must be in a file of at least one byte per this number of bytes.
LARGE, RATIO = 2**26, 100
#: Maximum length of a name.
LONGEST = 2**16


def read_serialized(path: Path, number: int) -> tuple[Mesh, bool]:
    """Read mesh `number` of a file, and whether it is flat, without smooth normals. Raises SceneError."""
    check_file(path, "model")
    with path.open("rb") as file:
        try:
            return _mesh(_Stream(*_part(file, number)), name_of(path))
        except (struct.error, zlib.error) as error:
            raise SceneError(f"{path}: is not a .serialized file, or is truncated: {error}; export it again") from None
        except SceneError as error:
            raise SceneError([f"{path}: {problem}" for problem in error.problems]) from None


def _part(file: BufferedReader, number: int) -> tuple[bytes, int]:
    """Return the compressed bytes of a mesh, and the version."""
    size = file.seek(0, 2)
    file.seek(0)
    magic, version = struct.unpack("<HH", file.read(HEADER))
    if magic != MAGIC or version not in (3, 4):
        raise SceneError(f"begins with {magic:#06x}, version {version}; a .serialized file begins with 0x041c, 3 or 4")
    file.seek(max(size - 4, 0))
    (count,) = struct.unpack("<I", file.read(4))
    form = "Q" if version == 4 else "I"
    start = size - 4 - count * struct.calcsize(form)
    if not 0 <= number < count or start < HEADER:
        raise SceneError(f"shape_index {number} is not in the file, which has {count} meshes; write a smaller one")
    file.seek(start)
    offsets = [*struct.unpack(f"<{count}{form}", file.read(size - 4 - start)), start]
    first, end = offsets[number] + HEADER, offsets[number + 1]
    if not HEADER <= first <= end <= start:
        raise SceneError(f"mesh {number} has the offset {offsets[number]}, outside the file; export it again")
    file.seek(first)
    return file.read(end - first), version


class _Stream:
    """Stream of the decompressed values of a mesh."""

    def __init__(self, compressed: bytes, version: int) -> None:
        self.version = version
        self.most = max(LARGE, RATIO * len(compressed))
        self._inflate = zlib.decompressobj()
        self._rest = compressed

    def bytes(self, count: int) -> bytes:
        """Return the next bytes. Raises struct.error if there are fewer."""
        found = self._inflate.decompress(self._rest, count) if count else b""
        self._rest = self._inflate.unconsumed_tail
        if len(found) < count:
            raise struct.error(f"{count - len(found)} bytes are missing")
        return found

    def numbers(self, form: str) -> tuple[int, ...]:
        """Return the next numbers, in struct's notation."""
        return struct.unpack(f"<{form}", self.bytes(struct.calcsize(f"<{form}")))

    def rows(self, count: int, width: int, dtype: str) -> NDArray[Any]:
        """Return the next array (count, width)."""
        return np.frombuffer(self.bytes(count * width * np.dtype(dtype).itemsize), dtype).reshape(count, width)


def _mesh(stream: _Stream, name: str) -> tuple[Mesh, bool]:
    (flags,) = stream.numbers("I")
    if stream.version == 4:
        for _ in range(LONGEST):
            if stream.bytes(1) == b"\0":
                break
    vertices, triangles = stream.numbers("QQ")
    real = "<f8" if flags & DOUBLE else "<f4"
    widths = 3 + 3 * bool(flags & NORMALS) + 2 * bool(flags & UV) + 3 * bool(flags & COLORS)
    if vertices * widths * np.dtype(real).itemsize + triangles * 12 > stream.most:
        raise SceneError(f"has {vertices} vertices and {triangles} triangles, too many for its size; export it again")
    points = stream.rows(vertices, 3, real).astype(np.float32)
    normals = stream.rows(vertices, 3, real).astype(np.float32) if flags & NORMALS else None
    uv = stream.rows(vertices, 2, real).astype(np.float32) if flags & UV else None
    if flags & COLORS:
        stream.rows(vertices, 3, real)
    faces = stream.rows(triangles, 3, "<u4").astype(np.int64)
    if faces.size and faces.max() >= vertices:
        raise SceneError(f"has a face with vertex {faces.max()} of {vertices}; export it again")
    mesh = Mesh(points, faces.astype(np.int32), name=name, normals=None if flags & FLAT else normals, uv=uv)
    return mesh, bool(flags & FLAT)
