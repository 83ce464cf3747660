"""Group a few triangles for brute force, so that rays can cull a whole group by its box."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .bvh import FloatArray, IntArray

Doubles = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
#: More triangles are taken in their order.
MOST = 256
#: Cost of a ray–box test relative to intersecting a pack of triangles.
BOX_COST = 0.1


def packs_of(aabb_min: FloatArray, aabb_max: FloatArray, size: int) -> list[IntArray]:
    """Group triangles with boxes (n, 3) into packs of at most `size`, group by group, the members of each ascending."""
    count = len(aabb_min)
    together = _groups(aabb_min, aabb_max, size) if size < count <= MOST else [np.arange(count)]
    return [group[first : first + size].astype(np.int32) for group in together for first in range(0, len(group), size)]


def _groups(aabb_min: FloatArray, aabb_max: FloatArray, size: int) -> list[NDArray[np.intp]]:
    """Return the members of each group.

    Greedily, starting from a single group, the part of a group that saves most expected cost is split off, while any
    does: a room's walls stay together, and the objects in it become groups. The probability that a ray hits a group is
    the ratio of its box's surface area to that of all. Packs are costed fractionally, at least one: otherwise splitting
    off the first objects would gain nothing. Candidate parts are those of an agglomerative clustering that merges two
    boxes into the smallest each time.
    """
    low, high = aabb_min.astype(np.float64), aabb_max.astype(np.float64)
    parts = _joined(low, high)
    everything = max(float(_half_area(low.min(axis=0), high.max(axis=0))), float(np.finfo(np.float64).tiny))

    def costs(members: BoolArray) -> Doubles:
        there = members[..., None]
        area = _half_area(np.where(there, low, np.inf).min(axis=1), np.where(there, high, -np.inf).max(axis=1))
        return np.asarray(BOX_COST + area / everything * np.maximum(members.sum(axis=1) / size, 1))

    def best_part(group: BoolArray) -> tuple[float, BoolArray]:
        """Return the cost that the best part saves, and its members."""
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
        found[k : k + 1] = [found[k] & ~part, part]
        best[k : k + 1] = [best_part(group) for group in found[k : k + 2]]


def _joined(low: Doubles, high: Doubles) -> BoolArray:
    """Return the members, (2n − 1, n), of all clusters as the boxes with the smallest union are merged two by two."""
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
