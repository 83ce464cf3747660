"""Reference builders by name, in numpy: each is a rule for splitting nodes. Large BVHs are built on a device."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .bvh import BoolArray, Bvh, FloatArray
from .top_down import OpenNodes, grow

Doubles = NDArray[np.float64]
Integers = NDArray[np.int64]


def sah(aabb_min: FloatArray, aabb_max: FloatArray, leaf_size: int, pack: int = 1) -> Bvh:
    """Build by the surface area heuristic, over all splits of the primitives sorted by centroid on each axis.

    Cost of a split (Nadolny 2026, 2.7; Wald 2007, "On fast construction of SAH-based bounding volume hierarchies"):
    1 + A_left/A ceil(n_left/pack) + A_right/A ceil(n_right/pack), against ceil(n/pack) for a leaf; `pack` primitives
    are intersected at the cost of one. aabb_min, aabb_max: (p, 3) float32, finite. No leaf exceeds `leaf_size`.
    """
    sweep = _Sweep.over(aabb_min, aabb_max)
    return grow(aabb_min, aabb_max, leaf_size, min(pack, leaf_size), lambda nodes: sweep.cut(nodes, leaf_size, pack))


def midpoint(aabb_min: FloatArray, aabb_max: FloatArray, leaf_size: int = 2, pack: int = 1) -> Bvh:
    """Split in the middle of the longest axis of the centroid bounds (Nadolny 2026, 5.4.4).

    With centroid bounds, unlike box bounds, both sides are non-empty unless all centroids coincide. There is no cost,
    so `pack` has no effect; it is there because all builders have the same signature.
    """
    return grow(aabb_min, aabb_max, leaf_size, leaf_size, _midpoint_cut)


BUILDERS: dict[str, Callable[[FloatArray, FloatArray, int, int], Bvh]] = {"sah": sah, "midpoint": midpoint}


def _midpoint_cut(nodes: OpenNodes) -> BoolArray:
    half = _half_centroids(nodes.boxes)
    low, high = nodes.reduce(np.minimum, half), nodes.reduce(np.maximum, half)
    longest = np.argmax(high - low, axis=0)
    middle = np.float32(0.5) * low + np.float32(0.5) * high
    right = np.zeros(len(nodes.ids), bool)
    for axis in range(3):
        right |= half[axis] > nodes.spread(np.where(longest == axis, middle[axis], np.float32(np.inf)))
    return right


def _half_centroids(boxes: FloatArray) -> FloatArray:
    """Return half the centroids (3, p) from min and negated max (6, p); half, so that differences do not overflow."""
    quarter = np.float32(0.25)
    return quarter * boxes[:3] - quarter * boxes[3:]


@dataclass(frozen=True, eq=False)
class _Sweep:
    """Ranks instead of coordinates: as integers they can be offset per node, and back, without loss.

    centroid: (3, p), ranks of the centroids of p primitives. box: (6, p), ranks of min and negated max, numbered
    consecutively across rows; value: (6p,), the coordinates by rank.
    """

    centroid: Integers
    box: Integers
    value: Doubles

    @staticmethod
    def over(aabb_min: FloatArray, aabb_max: FloatArray) -> _Sweep:
        boxes = np.concatenate([aabb_min.T, -aabb_max.T])
        first, value = np.arange(6)[:, None] * len(aabb_min), np.sort(boxes, axis=1).astype(np.float64)
        return _Sweep(_ranks(_half_centroids(boxes)), first + _ranks(boxes), value.ravel())

    def cut(self, nodes: OpenNodes, leaf_size: int, pack: int) -> BoolArray:
        """Apply the rule: return which primitives go right."""
        node = nodes.spread(np.arange(len(nodes.count)))
        orders = [np.argsort(node * self.centroid.shape[1] + ranks[nodes.ids]) for ranks in self.centroid]
        lasts, costs = zip(*(self._best(nodes, node, order, pack) for order in orders))
        best = np.argmin(costs, axis=0)
        area = _half_area(nodes.reduce(np.minimum, nodes.boxes).astype(np.float64))
        whole = (nodes.count <= leaf_size) & (area * _packs(nodes.count, pack) <= area + np.min(costs, axis=0))
        right = np.zeros(len(node), bool)
        for axis, (order, last) in enumerate(zip(orders, lasts)):
            cut_here = (best == axis) & ~whole
            right[order] |= np.arange(len(node)) > nodes.spread(np.where(cut_here, last, len(node)))
        return right

    def _best(self, nodes: OpenNodes, node: Integers, order: Integers, pack: int) -> tuple[Integers, Doubles]:
        """Return the index in `order` of the left side's last primitive, and the split's cost times the area, (k,)."""
        areas = [_half_area(union) for union in self._unions(node, self.box.take(nodes.ids[order], axis=1))]
        left_count = np.arange(1, len(node) + 1) - nodes.spread(nodes.start)
        right_count = nodes.spread(nodes.count) - left_count
        cost = areas[0] * _packs(left_count, pack)
        cost[:-1] += areas[1][1:] * _packs(right_count[:-1], pack)
        cost[right_count == 0] = np.inf
        least = nodes.reduce(np.minimum, cost)
        places = np.flatnonzero(cost == nodes.spread(least))
        return places[np.searchsorted(node[places], np.arange(len(least)))], least

    def _unions(self, node: Integers, boxes: Integers) -> tuple[Doubles, Doubles]:
        """Return the boxes around each node's primitives up to each one, and from each one on, (6, P).

        A running minimum over whole rows: ranks of different nodes are offset so far apart that each node starts
        afresh.
        """
        shift = node * self.centroid.shape[1]
        before = np.minimum.accumulate(boxes - shift, axis=1) + shift
        after = np.minimum.accumulate((boxes + shift)[:, ::-1], axis=1)[:, ::-1] - shift
        return self.value.take(before), self.value.take(after)


def _ranks(values: FloatArray) -> Integers:
    """Return the position of each value in its sorted row; equal values keep their order."""
    ranks = np.empty(values.shape, np.int64)
    np.put_along_axis(ranks, np.argsort(values, axis=1, kind="stable"), np.arange(values.shape[1])[None], axis=1)
    return ranks


def _packs(count: NDArray[np.integer], pack: int) -> NDArray[np.integer]:
    return -(-count // pack)


def _half_area(boxes: Doubles) -> Doubles:
    """Return half the surface areas (...) of boxes given as min and negated max, (6, ...)."""
    x, y, z = -(boxes[:3] + boxes[3:])
    area: Doubles = x * y + y * z + z * x
    return area
