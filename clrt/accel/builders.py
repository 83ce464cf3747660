"""Where to cut a node: the builders by name."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from .grow import OpenNodes, grow
from .tree import BoolArray, FloatArray, Tree, half_area

BINS = 16
#: Just below BINS, so that the largest centroid falls into the last bin.
_SCALE = np.float32(BINS * (1 - 1e-6))
#: A bin that no primitive lies beyond: the node stays whole.
_NO_PLANE = np.uint8(255)


def binned_sah(aabb_min: FloatArray, aabb_max: FloatArray, leaf_size: int, pack: int = 1) -> Tree:
    """Surface area heuristic with 16 bins of centroids on each of the three axes.

    Cost of a cut (Nadolny 2026, 2.7; Wald 2007, "On fast construction of SAH-based bounding volume hierarchies"):
    1 + A_left/A ceil(n_left/pack) + A_right/A ceil(n_right/pack), against ceil(n/pack) for a leaf; `pack` primitives
    are intersected at the price of one. aabb_min, aabb_max: (p, 3) float32, finite. No leaf exceeds `leaf_size`.
    """
    return grow(aabb_min, aabb_max, leaf_size, min(pack, leaf_size), lambda nodes: _sah_cut(nodes, leaf_size, pack))


def midpoint(aabb_min: FloatArray, aabb_max: FloatArray, leaf_size: int = 2, pack: int = 1) -> Tree:
    """Cut in the middle of the longest axis of the centroids' bounds (Nadolny 2026, 5.4.4).

    Bounds of centroids, not of boxes: both sides then hold something unless all centroids coincide. There is no cost,
    so `pack` changes nothing; it is there because all builders are called alike.
    """
    return grow(aabb_min, aabb_max, leaf_size, leaf_size, _midpoint_cut)


BUILDERS: dict[str, Callable[[FloatArray, FloatArray, int, int], Tree]] = {"sah": binned_sah, "midpoint": midpoint}


def _centroids(nodes: OpenNodes) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Half the centroids (3, P), and their bounds per node (3, k); half, so that no difference of two overflows."""
    quarter = np.float32(0.25)
    half = quarter * nodes.boxes[:3] - quarter * nodes.boxes[3:]
    return half, nodes.reduce(np.minimum, half), nodes.reduce(np.maximum, half)


def _midpoint_cut(nodes: OpenNodes) -> BoolArray:
    half, low, high = _centroids(nodes)
    longest = np.argmax(high - low, axis=0)
    middle = np.float32(0.5) * low + np.float32(0.5) * high
    right = np.zeros(len(nodes.ids), bool)
    for axis in range(3):
        right |= half[axis] > nodes.spread(np.where(longest == axis, middle[axis], np.float32(np.inf)))
    return right


def _sah_cut(nodes: OpenNodes, leaf_size: int, pack: int) -> BoolArray:
    half, low, high = _centroids(nodes)
    extent = np.where(high > low, high - low, np.float32(1))
    bins = [((half[axis] - nodes.spread(low[axis])) / nodes.spread(extent[axis]) * _SCALE).astype(np.uint8)
            for axis in range(3)]
    planes, costs = zip(*(_best_plane(nodes, bins[axis], pack) for axis in range(3)))
    best = np.argmin(costs, axis=0)
    area = _half_area(nodes.reduce(np.minimum, nodes.boxes))
    whole = (nodes.count <= leaf_size) & (area * _packs(nodes.count, pack) <= area + np.min(costs, axis=0))
    right = np.zeros(len(nodes.ids), bool)
    for axis in range(3):
        right |= bins[axis] > nodes.spread(np.where((best == axis) & ~whole, planes[axis], _NO_PLANE))
    return right


def _best_plane(nodes: OpenNodes, bins: NDArray[np.uint8], pack: int) -> tuple[NDArray[np.uint8], NDArray[np.float64]]:
    """The last bin on the left side, (k,), and its cost times the node's half area, (k,); inf where no plane cuts.

    Boxes of bins by `minimum.at`, one row of six at a time (numpy >= 1.25 has a fast path for it). Other ways, time of
    a whole build over this one's, 80 k to 100 k triangles: stable argsort of 16-bit keys, gather and `reduceat` 1.4 to
    1.5; the same with 64-bit keys 1.6 to 2.5; `minimum.at` on whole rows of six 3.6 to 6.2.
    """
    k = len(nodes.count)
    key = bins.astype(np.intp) * k + nodes.spread(np.arange(k))
    lefts = np.bincount(key, minlength=BINS * k).reshape(BINS, k)
    left = np.full((6, BINS, k), np.inf, np.float32)
    for union, box in zip(left.reshape(6, BINS * k), nodes.boxes):
        np.minimum.at(union, key, box)
    right = left.copy()
    for here in range(1, BINS):
        np.minimum(left[:, here], left[:, here - 1], out=left[:, here])
        np.minimum(right[:, -1 - here], right[:, -here], out=right[:, -1 - here])
        lefts[here] += lefts[here - 1]
    rights = nodes.count - lefts
    cost = _half_area(left[:, :-1]) * _packs(lefts[:-1], pack) + _half_area(right[:, 1:]) * _packs(rights[:-1], pack)
    cost[(lefts[:-1] == 0) | (rights[:-1] == 0)] = np.inf
    plane = np.argmin(cost, axis=0)
    return plane.astype(np.uint8), cost[plane, np.arange(k)]


def _packs(count: NDArray[np.integer], pack: int) -> NDArray[np.integer]:
    return -(-count // pack)


def _half_area(boxes: FloatArray) -> NDArray[np.float64]:
    """(6, ...) min and negated max to (...)."""
    return half_area(np.moveaxis(boxes[:3], 0, -1), -np.moveaxis(boxes[3:], 0, -1))
