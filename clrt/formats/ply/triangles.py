"""Triangles of a file's polygons and triangle strips."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..polygons import fans, ranges, triangulate
from .elements import Columns, Lists

log = logging.getLogger(__name__)
Ints = NDArray[np.int64]


class Triangles:
    """Triangles of polygons with any number of corners, whose vertices are `polygons`, indices into `points` (n, 3)."""

    def __init__(self, polygons: Lists, points: NDArray[Any]) -> None:
        self._points = points
        self._counts = polygons.counts.astype(np.int64)
        items = polygons.items
        self._items = items if np.issubdtype(items.dtype, np.integer) else items.astype(np.int64)
        self._all_triangles = len(items) == 3 * len(self._counts) and bool(np.all(self._counts == 3))

    def warn_of_ignored(self, path: Path) -> None:
        """Log how many polygons of the file have fewer than three corners."""
        if ignored := int((self._counts < 3).sum()):
            log.warning("%s: ignored: %d faces with fewer than 3 corners", path, ignored)

    @cached_property
    def vertices(self) -> NDArray[Any]:
        """(m, 3), of any integer dtype: the vertices of each triangle."""
        return self._items.reshape(-1, 3) if self._all_triangles else self._items[self.corners]

    @cached_property
    def corners(self) -> Ints:
        """(m, 3): their numbers among the corners of all polygons."""
        if self._all_triangles:
            return np.arange(len(self._items)).reshape(-1, 3)
        kept = self._counts > 2
        sizes = self._counts[kept]
        corners = ranges((np.cumsum(self._counts) - self._counts)[kept], sizes)
        items = self._items[corners]
        if len(items) and 0 <= items.min() and items.max() < len(self._points):
            return corners[triangulate(self._points.astype(np.float64), items, sizes)]
        return corners[fans(sizes)]

    @cached_property
    def polygons(self) -> Ints:
        """(m,): which polygon each triangle is part of; none for those with fewer than three corners."""
        return np.repeat(np.arange(len(self._counts)), np.maximum(self._counts - 2, 0))


def faces_of(elements: Mapping[str, Columns]) -> tuple[Columns, Lists] | None:
    """Return a file's faces and their vertices; None if it has none."""
    face = elements.get("face", Columns(0, {}, {}))
    lists = next((face.lists[name] for name in ("vertex_indices", "vertex_index") if name in face.lists), None)
    return None if lists is None or not face.number else (face, lists)


def strip_triangles(elements: Mapping[str, Columns]) -> Ints:
    """Return the triangles (m, 3) of triangle strips, in which −1 starts a new strip; every other one is reversed."""
    lists = elements.get("tristrips", Columns(0, {}, {})).lists
    strips = next(iter(lists.values()), Lists(np.zeros(0), np.zeros(0)))
    counts, items = strips.counts.astype(np.int64), strips.items.astype(np.int64)
    if len(items) < 3:
        return np.zeros((0, 3), np.int64)
    strip = np.repeat(np.arange(len(counts)), counts)
    is_start = np.append(True, (strip[1:] != strip[:-1]) | (items[:-1] < 0))
    place = np.arange(len(items))
    start = np.maximum.accumulate(np.where(is_start, place, 0))
    whole = (start[2:] <= place[:-2]) & (items[2:] >= 0)
    odd = (place[:-2] - start[:-2]) % 2 == 1
    triangles = np.stack([items[:-2], items[1:-1], items[2:]], axis=1)
    triangles[odd] = triangles[odd][:, [1, 0, 2]]
    a, b, c = triangles.T
    kept: Ints = triangles[whole & (a != b) & (b != c) & (c != a)]
    return kept
