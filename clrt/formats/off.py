"""Reader for OFF (Object File Format), in array operations.

The format: "OFF", Geomview manual, S. Levy and others, 1992-2007; ModelNet's files lack the first line break.
"""

from __future__ import annotations

import logging
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError
from ..threads import in_parallel
from .plain_text import plain_text
from .polygons import ranges, triangulate
from .text_numbers import Floats, Ints, floats, padded, per_line, reuse_memory, table

log = logging.getLogger(__name__)
COMMENT = re.compile(rb"#[^\n]*")
HEADER = re.compile(rb"\s*(?P<kind>[A-Za-z0-9]*?)OFF(?P<binary>\s+BINARY)?\s*(?P<counts>\d+[ ]+\d+)[^\n]*\n")
#: Bytes that are parsed at a time.
BLOCK = 1 << 20
#: Colors are up to 255 instead of 1 if one is as large as this.
BYTE_COLOR = 2


def parse_off(path: Path) -> dict[str, Any]:
    """Read vertices (n, 3), faces (m, 3), and vertex_normals (n, 3), vertex_colors (n, 3) and uv (n, 2) if the file has
    them. Colors of faces are ignored with a warning. Raises SceneError for malformed files."""
    reuse_memory()
    text = COMMENT.sub(b"", plain_text(path.read_bytes()))
    kind, vertex_count, face_count, start = _header(text)
    parsed = in_parallel(lambda limits: _numbers(text[slice(*limits)]), _blocks(text, start))
    counts = np.concatenate([np.zeros(0, np.int64), *(each for _, each in parsed)])
    values = np.concatenate([np.zeros(0), *(each for each, _ in parsed)])
    if len(counts) < vertex_count + face_count:
        raise SceneError(f"has {len(counts)} lines of {vertex_count} vertices and {face_count} faces; export it again")
    stop = int(counts[:vertex_count].sum())
    parts = _vertices(values[:stop], counts[:vertex_count], kind)
    parts["faces"] = _faces(path, values[stop:], counts[vertex_count:][:face_count], parts["vertices"])
    return parts


def _header(text: bytes) -> tuple[str, int, int, int]:
    """Return the letters before OFF, the numbers of vertices and faces, and where the first vertex is."""
    match = HEADER.match(text + b"\n")
    if match is None:
        raise SceneError("does not start with OFF and the numbers of vertices and faces; export it again")
    kind = match["kind"].decode()
    if match["binary"] or set(kind) - set("STCN"):
        raise SceneError(f'is of the kind "{kind}OFF{" BINARY" if match["binary"] else ""}"; export it as OFF, as text')
    vertex_count, face_count = map(int, match["counts"].split())
    return kind, vertex_count, face_count, match.end()


def _blocks(text: bytes, start: int) -> Iterator[tuple[int, int]]:
    """Yield the start and the stop of blocks of whole lines."""
    while start < len(text):
        stop = text.find(b"\n", start + BLOCK) + 1 or len(text)
        yield start, stop
        start = stop


def _numbers(block: bytes) -> tuple[Floats, Ints]:
    """Return all numbers of a block, and how many each of its lines has that are not empty."""
    text = padded(block)
    values, starts, malformed = floats(text)
    if malformed.size:
        word = text[starts[malformed[0]] :].tobytes().split()[0][:60].decode("utf-8", "replace")
        raise SceneError(f'has "{word}" in place of a number; export it again')
    counts = per_line(text, starts)
    return values, counts[counts > 0]


def _vertices(values: Floats, counts: Ints, kind: str) -> dict[str, Any]:
    """Return vertices, and normals, colors and texture coordinates if the letters N, C and ST announce them."""
    least = 3 + 3 * ("N" in kind) + 3 * ("C" in kind) + 2 * ("ST" in kind)
    if len(counts) and (fewest := counts.min()) < least:
        raise SceneError(f"a vertex has {fewest} numbers instead of {least}; export it again")
    columns = table(values, counts, int(counts.max(initial=least)))
    parts: dict[str, Any] = {"vertices": columns[:, :3]}
    place = 3
    if "N" in kind:
        parts["vertex_normals"] = columns[:, 3:6]
        place = 6
    if "C" in kind:
        colors = columns[:, place : place + 3]
        parts["vertex_colors"] = colors / (255 if colors.max(initial=0) >= BYTE_COLOR else 1)
    if "ST" in kind:
        parts["uv"] = columns[:, -2:]
    return parts


def _faces(path: Path, values: Floats, counts: Ints, vertices: Floats) -> NDArray[np.int64]:
    """Return the triangles of polygons, each a line: the number of corners, these, and possibly a color."""
    first = np.cumsum(counts) - counts
    with np.errstate(invalid="ignore"):
        sizes = values[first].astype(np.int64)
    if ((sizes < 1) | (sizes >= counts)).any():
        face = int(np.argmax((sizes < 1) | (sizes >= counts)))
        raise SceneError(f"faces[{face}] has {counts[face] - 1} numbers for {sizes[face]} corners; export it again")
    if (sizes + 1 < counts).any():
        log.warning("%s: ignored: the colors of faces", path)
    first, sizes = first[sizes > 2], sizes[sizes > 2]
    with np.errstate(invalid="ignore"):
        corners = values[ranges(first + 1, sizes)].astype(np.int64)
    wrong = (corners < 0) | (corners >= len(vertices))
    if wrong.any():
        corner = int(wrong.argmax())
        face = int(np.searchsorted(np.cumsum(sizes), corner, "right"))
        valid = f"valid indices are 0 to {len(vertices) - 1}"
        raise SceneError(f"faces[{face}] uses vertex {corners[corner]}, but {valid}; export it again")
    return corners[triangulate(vertices, corners, sizes)]
