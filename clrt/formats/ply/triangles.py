"""Triangles of a file's polygons and triangle strips."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..polygons import fans, ranges, triangulate
from .elements import Columns, Lists

log = logging.getLogger(__name__)
Ints = NDArray[np.int64]


class Triangles:
    """Triangles of polygons with any number of corners. polygons: their vertices, indices into `points` (n, 3)."""

    def __init__(self, polygons: Lists, points: NDArray[np.floating]) -> None:
        self._polygons, self._points = polygons, points
        self._all_triangles = len(polygons.items) == 3 * len(polygons.counts) and bool(np.all(polygons.counts == 3))

    @cached_property
    def vertices(self) -> NDArray[Any]:
        """(m, 3), of any integer dtype: the vertices of each triangle, which may be out of range."""
        return self._items.reshape(-1, 3) if self._all_triangles else self._items[self.corners]

    @property
    def _items(self) -> NDArray[Any]:
        items = self._polygons.items
        return items if np.issubdtype(items.dtype, np.integer) else items.astype(np.int64)

    @cached_property
    def corners(self) -> Ints:
        """(m, 3): their numbers among the corners of all polygons."""
        counts, items = self._polygons.counts.astype(np.int64), self._items
        used = counts >= 3
        if not used.all():
            log.warning("%d faces with fewer than 3 corners are ignored", np.sum(~used))
        places = ranges((np.cumsum(counts) - counts)[used], counts[used])
        if len(items) and (items.min() < 0 or items.max() >= len(self._points)):
            return places[fans(counts[used])]
        return places[triangulate(np.asarray(self._points, np.float64), items[places], counts[used])]

    @cached_property
    def polygons(self) -> Ints:
        """(m,): which polygon each triangle is part of; none for those with fewer than three corners."""
        counts = self._polygons.counts.astype(np.int64)
        return np.repeat(np.arange(len(counts)), np.maximum(counts - 2, 0))


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
