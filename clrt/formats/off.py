"""Reader for OFF files and their variants with colors, normals and texture coordinates.

The format: Geomview's manual, "OFF Files". Each vertex and each face is on a line of its own.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError
from ..file_names import printable
from ..scene.geometry.mesh_faults import index_problems
from .plain_text import plain_text
from .ply.elements import Lists
from .ply.triangles import Triangles
from .polygons import ranges
from .referenced_files import name_of
from .seams import PLAIN, with_corner_attributes
from .text_numbers import numbers

Doubles = NDArray[np.float64]
Ints = NDArray[np.int64]
_COMMENT = re.compile(rb"#[^\n]*")
_KEYWORD = re.compile(rb"\s*(ST)?(C)?(N)?(4)?(n)?(?:OFF|off)(?=\s|\d)[ \t]*(BINARY)?")


class Lines(NamedTuple):
    """Numbers of a text, and how many of them are on each line, of those that have any."""

    numbers: Doubles
    counts: Ints


def parse_off(path: Path) -> dict[str, Any]:
    """Read an OFF file, with trimesh's names of arrays: vertices (n, 3), faces (m, 3), vertex_normals (n, 3) or None,
    uv (n, 2) or None with v up, vertex_colors (n, 3 or 4) or None, from 0 to 1.

    Raises SceneError for malformed files and unsupported variants.
    """
    text = plain_text(path.read_bytes())
    text = _COMMENT.sub(b"", text) if b"#" in text else text
    keyword = _KEYWORD.match(text)
    if keyword is None and not re.match(rb"\s*\d", text):
        raise _malformed('does not begin with "OFF"')
    if keyword and (keyword[5] or keyword[6]):
        kind = printable(keyword[0].decode().strip())
        raise SceneError(f'is an OFF file of the kind "{kind}", which is not supported; export it as plain text')
    values, counts, word = numbers(text, keyword.end() if keyword else 0)
    if word:
        raise _malformed(f'has "{word}" in place of a number')
    lines = Lines(values, counts)
    if not len(lines.counts) or lines.counts[0] < 2:
        raise _malformed("has no line with its numbers of vertices and faces")
    vertices, faces = lines.numbers[:2].astype(np.int64).tolist()
    if not 0 <= vertices <= vertices + faces < len(lines.counts):
        raise _malformed(f"counts {vertices} vertices and {faces} faces, but has {len(lines.counts) - 1} lines of them")
    starts = np.cumsum(lines.counts) - lines.counts
    ends = (1, 1 + vertices, 1 + vertices + faces)
    first, second, third = np.append(starts, len(lines.numbers))[list(ends)].tolist()
    whole = _vertices(Lines(lines.numbers[first:second], lines.counts[ends[0] : ends[1]]), keyword)
    return _with_faces(path, whole, Lines(lines.numbers[second:third], lines.counts[ends[1] : ends[2]]))


def _malformed(fault: str) -> SceneError:
    return SceneError(f"cannot be read as OFF: it {fault}; export the model again")


def _vertices(lines: Lines, keyword: re.Match[bytes] | None) -> dict[str, Any]:
    """Return the arrays of vertices: position, normal, color and texture coordinates, as the keyword says."""
    width = int(lines.counts[0]) if len(lines.counts) else 3
    if np.any(lines.counts != width):
        raise _malformed("has vertices with different numbers of values")
    textured, colored, normal, homogeneous = (keyword[i] is not None if keyword else False for i in range(1, 5))
    size, end = 4 if homogeneous else 3, width - 2 * textured
    color = size + 3 * normal
    if not color + 3 * colored <= end:
        raise _malformed(f"has vertices of {width} values, fewer than its first line names")
    rows = lines.numbers.reshape(-1, width)
    return {
        "vertices": rows[:, :3] / rows[:, 3:4] if homogeneous else rows[:, :3],
        "vertex_normals": rows[:, size:color] if normal else None,
        "vertex_colors": _unit(rows[:, color : min(color + 4, end)]) if colored else None,
        "uv": rows[:, end:] if textured else None,
    }


def _with_faces(path: Path, whole: dict[str, Any], lines: Lines) -> dict[str, Any]:
    """Return the arrays with the triangles of faces, and with the faces' colors if vertices have none."""
    starts = np.cumsum(lines.counts) - lines.counts
    sizes = lines.numbers[starts].astype(np.int64)
    extra = lines.counts - 1 - sizes
    if np.any(sizes < 0) or np.any(extra < 0):
        raise _malformed("has a face with fewer values than it counts")
    if len(sizes) and (lines.counts == lines.counts[0]).all() and (sizes == sizes[0]).all():
        corners = lines.numbers.reshape(len(sizes), -1)[:, 1 : sizes[0] + 1].astype(np.int64).ravel()
    else:
        corners = lines.numbers[ranges(starts + 1, sizes)].astype(np.int64)
    triangles = Triangles(Lists(sizes, corners), whole["vertices"])
    if problems := index_problems(triangles.vertices, len(whole["vertices"]), f'mesh "{name_of(path)}"'):
        raise SceneError(problems)
    triangles.warn_of_ignored(path)
    whole = {**whole, "faces": triangles.vertices}
    colored = extra >= 3
    if whole["vertex_colors"] is not None or not colored.any():
        return whole
    colors = np.full((len(sizes), 3), PLAIN)
    colors[colored] = _unit(lines.numbers[(starts + 1 + sizes)[colored, None] + np.arange(3)])
    return with_corner_attributes(whole, {"vertex_colors": np.repeat(colors[triangles.polygons], 3, axis=0)})


def _unit(colors: Doubles) -> Doubles:
    """Return colors from 0 to 1, given as these or up to 255."""
    return colors / 255 if np.any(colors > 1) else colors
