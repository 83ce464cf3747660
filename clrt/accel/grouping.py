"""A few triangles in groups, for where there is no tree: what stands together is met, or passed by, as a whole."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .tree import FloatArray, IntArray

Doubles = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
#: More are taken in their order.
MOST = 256
#: What a ray pays for a group's box, where a pack of triangles costs 1.
BOX_COST = 0.1


def packs_of(aabb_min: FloatArray, aabb_max: FloatArray, size: int) -> list[IntArray]:
    """Triangles with boxes (n, 3) to packs of at most `size`, group by group, the members of each ascending."""
    count = len(aabb_min)
    together = _groups(aabb_min, aabb_max, size) if size < count <= MOST else [np.arange(count)]
    return [group[first:first + size].astype(np.int32) for group in together for first in range(0, len(group), size)]


def _groups(aabb_min: FloatArray, aabb_max: FloatArray, size: int) -> list[NDArray[np.intp]]:
    """Members of each group.

    From one group of all on, that part of a group is made a group of its own which then saves most, as long as one
    does: a room's walls stay together, and what stands in the room leaves them. A ray meets a group as often as the
    surface of its box has to that of all, and pays for parts of packs as if they could be had: else nothing would be
    gained by the first things that leave. The parts that are tried are those that arise as boxes are joined two by two,
    each time to the smallest.
    """
    low, high = aabb_min.astype(np.float64), aabb_max.astype(np.float64)
    parts = _joined(low, high)
    everything = max(float(_half_area(low.min(axis=0), high.max(axis=0))), float(np.finfo(np.float64).tiny))

    def costs(members: BoolArray) -> Doubles:
        there = members[..., None]
        area = _half_area(np.where(there, low, np.inf).min(axis=1), np.where(there, high, -np.inf).max(axis=1))
        return np.asarray(BOX_COST + area / everything * np.maximum(members.sum(axis=1) / size, 1))

    def best_part(group: BoolArray) -> tuple[float, BoolArray]:
        """What is saved by it, and its members."""
        inside = parts[~np.any(parts & ~group, axis=1) & np.any(group & ~parts, axis=1)]
        if not len(inside):
            return 0.0, group
        saved = costs(group[None]) - costs(inside) - costs(group & ~inside)
        return float(saved.max()), inside[saved.argmax()]

    found = [np.ones(len(low), bool)]
    best = [best_part(found[0])]
    while True:
        k = max(range(len(found)), key=lambda k: best[k][0])
        saved, part = best[k]
        if saved <= 0:
            return [np.flatnonzero(group) for group in found]
        found[k:k + 1] = [found[k] & ~part, part]
        best[k:k + 1] = [best_part(group) for group in found[k:k + 2]]


def _joined(low: Doubles, high: Doubles) -> BoolArray:
    """(2n − 1, n) members of each single box, and of each that arises as two are joined to the smallest."""
    count = len(low)
    low, high, members = low.copy(), high.copy(), np.eye(count, dtype=bool)
    area = _half_area(np.minimum(low[:, None], low), np.maximum(high[:, None], high))
    np.fill_diagonal(area, np.inf)
    joined = list(members.copy())
    for _ in range(count - 1):
        a, b = divmod(int(area.argmin()), count)
        members[a] |= members[b]
        low[a], high[a] = np.minimum(low[a], low[b]), np.maximum(high[a], high[b])
        area[b] = area[:, b] = np.inf
        there = np.isfinite(area[a])
        area[a, there] = area[there, a] = _half_area(np.minimum(low[a], low[there]), np.maximum(high[a], high[there]))
        joined.append(members[a].copy())
    return np.array(joined)


def _half_area(low: Doubles, high: Doubles) -> Doubles:
    x, y, z = np.moveaxis(high - low, -1, 0)
    return np.asarray(x * y + y * z + z * x)
