"""Top-down construction of a binary BVH, all open nodes of a level at once. A builder supplies the split rule."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import count as naturals
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .bvh import BoolArray, Bvh, FloatArray, IntArray, empty_tree

#: From this level on, nodes are split at the median of their order, so that depth <= MAX_FREE_DEPTH + ceil(log2 p).
MAX_FREE_DEPTH = 40
#: Nodes per call of a rule: its temporary arrays fit the cache, and are far below 64 MB.
NODES_AT_ONCE = 4096


@dataclass(frozen=True, eq=False)
class OpenNodes:
    """k nodes and their P primitives; the primitives of a node are contiguous, in the order of the nodes.

    boxes: (6, P) float32, the primitives' min and negated max, so that a union is one `minimum`.
    ids: (P,) int32. first: (k,) int32, where a node's primitives begin in the final order. count: (k,) int32.
    """

    boxes: FloatArray
    ids: IntArray
    first: IntArray
    count: IntArray

    @property
    def start(self) -> IntArray:
        """Return (k,) int32, where a node's primitives begin in `boxes` and `ids`."""
        return np.cumsum(self.count, dtype=np.int32) - self.count

    def spread(self, values: NDArray[Any]) -> NDArray[Any]:
        """Expand values per node, (k,), to values per primitive, (P,)."""
        return np.repeat(values, self.count)

    def reduce(self, operation: np.ufunc, values: NDArray[Any]) -> NDArray[Any]:
        """Reduce values per primitive, (..., P), to values per node, (..., k)."""
        result: NDArray[Any] = operation.reduceat(values, self.start, axis=-1)
        return result

    def select(self, nodes: BoolArray) -> OpenNodes:
        """Return the selected nodes."""
        if nodes.all():
            return self
        kept = np.flatnonzero(self.spread(nodes))
        return OpenNodes(self.boxes.take(kept, axis=1), self.ids.take(kept), self.first[nodes], self.count[nodes])

    def batches(self) -> list[OpenNodes]:
        """Return the nodes in batches of NODES_AT_ONCE."""
        cuts = np.arange(0, len(self.count), NODES_AT_ONCE)
        edges = np.append(self.start[cuts], len(self.ids))
        return [
            OpenNodes(
                self.boxes[:, low:high],
                self.ids[low:high],
                self.first[cut : cut + NODES_AT_ONCE],
                self.count[cut : cut + NODES_AT_ONCE],
            )
            for cut, low, high in zip(cuts, edges[:-1], edges[1:])
        ]

    def split(self, right: BoolArray) -> OpenNodes:
        """Return the children, left and right alternating: a stable partition of each node by `right` (P,)."""
        rights = self.reduce(np.add, right.astype(np.int32))
        lefts = self.count - rights
        rank = np.cumsum(right, dtype=np.int32) - self.spread(np.cumsum(rights, dtype=np.int32) - rights)
        here = np.arange(len(right), dtype=np.int32)
        source = np.empty(len(right), np.intp)
        source[np.where(right, self.spread(self.start + lefts - 1) + rank, here - rank)] = here
        return OpenNodes(
            self.boxes.take(source, axis=1),
            self.ids.take(source),
            np.stack([self.first, self.first + lefts], axis=1).ravel(),
            np.stack([lefts, rights], axis=1).ravel(),
        )


#: A split rule returns which primitives go right, (P,) bool. If none (or all) of a node's do, the node is not split.
Rule = Callable[[OpenNodes], BoolArray]


def grow(aabb_min: FloatArray, aabb_max: FloatArray, leaf_size: int, small: int, rule: Rule) -> Bvh:
    """Build a binary BVH over primitives with boxes (p, 3) float32, finite, split by `rule`.

    Nodes of up to `small` primitives become leaves without calling the rule. Nodes that it does not split become leaves
    if they have up to `leaf_size` primitives; others, and those from MAX_FREE_DEPTH on, are split at the median of
    their order.
    """
    if len(aabb_min) == 0:
        return empty_tree()
    total = len(aabb_min)
    nodes = OpenNodes(
        np.concatenate([aabb_min.T, -aabb_max.T]),
        np.arange(total, dtype=np.int32),
        np.zeros(1, np.int32),
        np.full(1, total, np.int32),
    )
    order = np.empty(total, np.int32)
    bounds, left_first, count, made = [], [], [], 1
    for level in naturals():
        right, leaf = _force(nodes, _cut(nodes, small, rule if level < MAX_FREE_DEPTH else _nowhere), leaf_size)
        bounds.append(nodes.reduce(np.minimum, nodes.boxes))
        left_first.append(np.where(leaf, nodes.first, made + 2 * (np.cumsum(~leaf, dtype=np.int32) - 1)))
        count.append(np.where(leaf, nodes.count, 0))
        closed = nodes.spread(leaf)
        place = nodes.spread(nodes.first - nodes.start) + np.arange(len(right), dtype=np.int32)
        order[place[closed]] = nodes.ids[closed]
        if leaf.all():
            break
        made += 2 * int(np.count_nonzero(~leaf))
        nodes = nodes.select(~leaf).split(right[~closed])
    boxes = np.concatenate(bounds, axis=1).T
    return Bvh(
        np.ascontiguousarray(boxes[:, :3]),
        np.ascontiguousarray(-boxes[:, 3:]),
        np.concatenate(left_first).astype(np.int32),
        np.concatenate(count).astype(np.int32),
        np.zeros(len(boxes), bool),
        order,
        np.empty(0, np.int32),
    )


def _nowhere(nodes: OpenNodes) -> BoolArray:
    return np.zeros(len(nodes.ids), bool)


def _cut(nodes: OpenNodes, small: int, rule: Rule) -> BoolArray:
    """Return the rule's answer for nodes with more than `small` primitives, and False for the primitives of others."""
    large = nodes.count > small
    right = np.zeros(len(nodes.ids), bool)
    if large.any():
        answers = [rule(batch) for batch in nodes.select(large).batches()]
        right[nodes.spread(large)] = np.concatenate(answers)
    return right


def _force(nodes: OpenNodes, right: BoolArray, leaf_size: int) -> tuple[BoolArray, BoolArray]:
    """Split at the median what is too large for a leaf and was not split: return (P,) goes right, (k,) is a leaf."""
    rights = nodes.reduce(np.add, right.astype(np.int32))
    uncut = (rights == 0) | (rights == nodes.count)
    stuck = uncut & (nodes.count > leaf_size)
    if stuck.any():
        here = np.arange(len(right), dtype=np.int32)
        middle = here >= nodes.spread(nodes.start + nodes.count // 2)
        right = np.where(nodes.spread(stuck), middle, right)
    return right, uncut & ~stuck
