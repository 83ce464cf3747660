"""Binary trees over the places of vertices, whose leaves hold about equally many, of surfaces that face one way."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..compile.records import SPATIAL_NODE

#: The axis of a leaf.
LEAF = -1
#: A node is cut along an axis of the normal while the normals' variance along it exceeds this.
NORMAL_VARIANCE = 0.1
#: A tree is built from about this many vertices per leaf; the others are left out.
BUILT_FROM = 64


@dataclass(frozen=True)
class SpatialTree:
    """nodes: SPATIAL_NODE records, parents before children; the `child` of a leaf is its number among the leaves.

    held: (nodes,), about how many vertices each holds.
    """

    nodes: NDArray[Any]
    held: NDArray[np.float64]

    @property
    def is_leaf(self) -> NDArray[np.bool_]:
        """Return (nodes,), whether each is a leaf."""
        return np.asarray(self.nodes["axis"] == LEAF)

    @property
    def leaf_count(self) -> int:
        """Return the number of leaves."""
        return int(np.count_nonzero(self.is_leaf))

    def leaves_at(self, places: NDArray[np.float32]) -> NDArray[np.int32]:
        """Return (n,), the numbers of the leaves that hold the places."""
        axes, values, children = (np.ascontiguousarray(self.nodes[name]) for name in ("axis", "value", "child"))
        flat, at = places.ravel(), np.zeros(len(places), np.int32)
        inside = np.flatnonzero(axes[at] != LEAF)
        while len(inside):
            node = at[inside]
            node = children[node] + (flat[6 * inside + axes[node]] >= values[node])
            at[inside] = node
            inside = inside[axes[node] != LEAF]
        return children[at]

    def merged(self, most: int) -> tuple[SpatialTree, NDArray[np.int32]]:
        """Return the tree without what is below nodes that hold at most `most`, and the number of the leaf there that
        each leaf of this one is in."""
        ends = self.is_leaf | (self.held <= most)
        top = list(range(len(self.nodes)))  # the node that remains of each, itself or one above
        for parent in np.flatnonzero(~self.is_leaf).tolist():
            if top[parent] != parent or ends[parent]:
                child = int(self.nodes["child"][parent])
                top[child] = top[child + 1] = top[parent]
        kept = np.equal(top, np.arange(len(top)))
        nodes, held = self.nodes[kept], self.held[kept]
        number, leaf = np.cumsum(kept) - 1, np.cumsum(ends & kept) - 1
        ended = ends[kept]
        nodes["axis"][ended] = LEAF
        nodes["child"] = np.where(ended, leaf[kept], number[np.where(ended, 0, nodes["child"])])
        return SpatialTree(nodes, held), leaf[np.array(top)[self.is_leaf]].astype(np.int32)


def spatial_tree(places: NDArray[np.float32], most: int) -> SpatialTree:
    """Return a tree over `places`, (n, 6) positions and normals, with about `most` per leaf.

    Nodes are cut at the mean: at that of the normals until they face one way, else of the positions along the axis of
    their largest variance (Ruppert, Herholz and Lensch 2020).
    """
    step = max(1, most // BUILT_FROM)
    own = np.asarray(places[::step], np.float64)
    node = np.zeros(len(own), np.int64)
    levels: list[NDArray[Any]] = []
    held = []
    count, end, leaves = 1, 1, 0
    while count:
        level = np.zeros(count, SPATIAL_NODE)
        number = np.bincount(node, minlength=count)
        sums, squares = (
            np.stack([np.bincount(node, values, count) for values in each.T]) / np.maximum(number, 1)
            for each in (own, own**2)
        )
        variances = squares - sums**2
        by_position, by_normal = variances[:3].argmax(axis=0), variances[3:].argmax(axis=0)
        axis = np.where(variances[3:].max(axis=0) > NORMAL_VARIANCE, 3 + by_normal, by_position)
        value = sums[axis, np.arange(count)].astype(np.float32)
        above = own[np.arange(len(own)), axis[node]] >= value[node]
        more = np.bincount(node, above, count)
        inner = (number > most // step) & (more > 0) & (more < number)
        rank = np.cumsum(inner) - 1
        level["axis"], level["value"] = np.where(inner, axis, LEAF), np.where(inner, value, 0)
        level["child"] = np.where(inner, end + 2 * rank, leaves + np.cumsum(~inner) - 1)
        levels.append(level)
        held.append(number * float(step))
        leaves += int(np.count_nonzero(~inner))
        kept = inner[node]
        own, node = own[kept], 2 * rank[node[kept]] + above[kept]
        count = 2 * int(np.count_nonzero(inner))
        end += count
    return SpatialTree(np.concatenate(levels), np.concatenate(held))
