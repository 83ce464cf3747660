"""Triangles of a PLY file's polygons and triangle strips."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .elements import Columns, Lists

log = logging.getLogger(__name__)
Ints = NDArray[np.int64]


class Fans:
    """Triangles of polygons with any number of corners, whose vertices are `polygons`."""

    def __init__(self, polygons: Lists) -> None:
        self._polygons = polygons
        self._all_triangles = len(polygons.items) == 3 * len(polygons.counts) and bool(np.all(polygons.counts == 3))

    @cached_property
    def vertices(self) -> NDArray[Any]:
        """(m, 3), of any integer dtype: the vertices of each triangle."""
        items = self._polygons.items
        items = items if np.issubdtype(items.dtype, np.integer) else items.astype(np.int64)
        return items.reshape(-1, 3) if self._all_triangles else items[self.corners]

    @cached_property
    def corners(self) -> Ints:
        """(m, 3): their numbers among the corners of all polygons."""
        counts = self._polygons.counts.astype(np.int64)
        step = np.arange(len(self.polygons)) - np.searchsorted(self.polygons, self.polygons)
        first = (np.cumsum(counts) - counts)[self.polygons]
        return np.stack([first, first + step + 1, first + step + 2], axis=1)

    @cached_property
    def polygons(self) -> Ints:
        """(m,): which polygon each triangle is part of; none for those with fewer than three corners."""
        counts = self._polygons.counts.astype(np.int64)
        if ignored := int((counts < 3).sum()):
            log.warning("%d faces with fewer than 3 corners are ignored", ignored)
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
