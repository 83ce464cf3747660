"""Conservative rasterization of a mesh's faces over its texture coordinates: every texel that a face covers partly."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .triangle_points import cross, nearest_weights, squared_lengths

Doubles = NDArray[np.float64]
#: Maximum number of rows of faces, and of texels, that are processed at once.
ROWS, TEXELS = 1 << 17, 1 << 18
#: Texels from a face's edges within which its neighbor may cover the same center, by rounding.
EDGE = 1e-3


class TexelFaces(NamedTuple):
    """The face nearest to each of the places in each texel, of those that cover the texel, (height, width, places)
    int32, −1 where none does; and the number of texels whose centers several faces cover."""

    face: NDArray[np.int32]
    overlaps: int


def texel_faces(corners: Doubles, faces: NDArray[np.integer], size: tuple[int, int], places: Doubles) -> TexelFaces:
    """Rasterize triangles, corners (m, 3, 2) in texels from the image's upper left corner, numbered by `faces` (m,).

    places: (k, 2), in a texel, from its upper left corner.
    """
    width, height = size
    found = np.full(height * width * len(places), -1, np.int32)
    nearest = np.full(found.size, np.inf, np.float32)
    covering = np.zeros(height * width, np.uint16)
    for triangle, texel in _covered(corners, width, height):
        corner = np.stack([texel % width, texel // width], axis=1).astype(np.float64)
        np.add.at(covering, texel[_well_inside(corners[triangle], corner + 0.5)], 1)
        for number, place in enumerate(places):
            slot = texel * len(places) + number
            missed = np.flatnonzero(nearest[slot] > 0)
            own, slot = triangle[missed], slot[missed]
            distance = _distances(corners[own], corner[missed] + place).astype(np.float32)
            before = nearest[slot]
            np.minimum.at(nearest, slot, distance)
            closer = (distance == nearest[slot]) & (distance < before)
            found[slot[closer]] = faces[own[closer]]
    return TexelFaces(found.reshape(height, width, len(places)), int(np.count_nonzero(covering > 1)))


def _distances(corners: Doubles, points: Doubles) -> Doubles:
    """Return the squared distances of points from their triangles."""
    nearest = np.einsum("nk,nki->ni", nearest_weights(corners, points), corners)
    return squared_lengths(nearest - points)


def _well_inside(corners: Doubles, points: Doubles) -> NDArray[np.bool_]:
    """Return which points are in their triangle, and not close to its edges."""
    edges = np.roll(corners, -1, axis=1) - corners
    lengths = np.hypot(edges[..., 0], edges[..., 1])
    sides = cross(edges, points[:, None] - corners)
    left, right = (sides > EDGE * lengths).all(axis=1), (sides < -EDGE * lengths).all(axis=1)
    return np.logical_or(left, right)


def _covered(corners: Doubles, width: int, height: int) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Yield pairs of triangles and the texels that they cover at least partly, in bounded numbers."""
    for triangle, row in _spans(corners, height):
        left, right = _extents(corners[triangle], row)
        first = np.clip(np.floor(left).astype(np.intp), 0, width - 1)
        count = np.clip(np.ceil(right).astype(np.intp), first + 1, width) - first
        for rows in _pieces(count, TEXELS):
            texel = np.repeat(row[rows] * width + first[rows], count[rows]) + _within(count[rows])
            yield np.repeat(triangle[rows], count[rows]), texel


def _spans(corners: Doubles, height: int) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Yield pairs of triangles and the rows of texels that they cover at least partly."""
    low, high = corners[..., 1].min(axis=1), corners[..., 1].max(axis=1)
    first = np.clip(np.floor(low).astype(np.intp), 0, height - 1)
    count = np.clip(np.ceil(high).astype(np.intp), first + 1, height) - first
    for piece in _pieces(count, ROWS):
        triangles = np.arange(piece.start, piece.stop)
        yield np.repeat(triangles, count[piece]), np.repeat(first[piece], count[piece]) + _within(count[piece])


def _pieces(counts: NDArray[np.intp], most: int) -> Iterator[slice]:
    """Yield ranges whose counts sum up to at most `most`, or that hold one."""
    ends, start = np.cumsum(counts), 0
    while start < len(counts):
        limit = most + (ends[start - 1] if start else 0)
        stop = max(start + 1, int(np.searchsorted(ends, limit, side="right")))
        yield slice(start, stop)
        start = stop


def _within(counts: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return 0, 1, … for each count."""
    return np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)


def _extents(corners: Doubles, row: NDArray[np.intp]) -> tuple[Doubles, Doubles]:
    """Return the smallest and the largest x of the triangles in these rows of texels, both on their edges."""
    left, right = np.full(len(row), np.inf), np.full(len(row), -np.inf)
    for first in range(3):
        (x0, y0), (x1, y1) = corners[:, first].T, corners[:, (first + 1) % 3].T
        level = y0 == y1
        rise = np.where(level, 1, y1 - y0)
        ends = np.stack([(row - y0) / rise, (row + 1 - y0) / rise])
        start, end = np.maximum(ends.min(axis=0), 0), np.minimum(ends.max(axis=0), 1)
        start, end = np.where(level, 0, start), np.where(level, 1, end)
        crosses = np.where(level, (row <= y0) & (y0 <= row + 1), start <= end)
        for along in (start, end):
            x = x0 + along * (x1 - x0)
            left, right = np.where(crosses, np.minimum(left, x), left), np.where(crosses, np.maximum(right, x), right)
    missed = left > right  # by rounding, at a corner
    middle = corners[..., 0].mean(axis=1)
    return np.where(missed, middle, left), np.where(missed, middle, right)
