"""Wide BVHs: each node has the boxes of up to eight children, which a ray tests together."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError
from .bvh import BoolArray, Bvh, FloatArray, IntArray, expected_work, half_area, intersections

#: Child reference of an unused slot; used slots come first.
EMPTY = 0x7FFFFFFF
#: A leaf reference has 27 bits for the first primitive, 1 for its kind, 3 for the count.
MAX_PRIMITIVES = 1 << 27
MAX_LEAF = 8


@dataclass(frozen=True, eq=False)
class WideBvh:
    """A wide BVH of k nodes in breadth-first order, the root first.

    aabb_min, aabb_max: (k, width, 3) float32, the children's boxes; inverted (min +inf, max −inf) in unused slots. Such
    a box is never hit if near and far planes are selected by the signs of the ray's direction; with the min and max of
    the distances to both planes it would be all of space.
    child: (k, width) int32: a node's index, ~(first << 4 | sphere << 3 | count − 1) for a leaf, EMPTY if unused.
    order, sphere_order: the orders that a leaf's `first` indexes, as in the binary BVH.
    """

    aabb_min: FloatArray
    aabb_max: FloatArray
    child: IntArray
    order: IntArray
    sphere_order: IntArray

    @property
    def interior(self) -> BoolArray:
        """Return which slots hold a node, (k, width) bool."""
        used: BoolArray = (self.child >= 0) & (self.child != EMPTY)
        return used

    def levels(self) -> Iterator[IntArray]:
        """Yield node indices, level by level from the root."""
        nodes = np.zeros(1, np.int32)
        while nodes.size:
            yield nodes
            nodes = self.child[nodes][self.interior[nodes]]

    @property
    def depth(self) -> int:
        """Return the number of edges from the root to the deepest leaf; leaves are always below a node."""
        return sum(1 for _ in self.levels()) if self.order.size + self.sphere_order.size else 0

    @property
    def stack_bound(self) -> int:
        """Return the maximum stack size of a traversal that pushes all children of a node and then pops the next one.

        One fewer if it keeps the next one in a register. The bound is tight: a node is popped with at most the sum of
        (children − 1) over its ancestors left, which some order of children reaches; then it pushes its own children.
        """
        children = np.count_nonzero(self.child != EMPTY, axis=1)
        bound, left = 1, np.zeros(len(self.child), np.intp)
        for nodes in self.levels():
            full = left[nodes] + children[nodes]
            bound = max(bound, int(full.max()))
            inner = self.interior[nodes]
            left[self.child[nodes][inner]] = np.repeat(full - 1, np.count_nonzero(inner, axis=1))
        return bound

    def sah_cost(self, pack: int = 1) -> float:
        """Return the cost as Tree.sah_cost: 1 per wide node, and 1 per test of `pack` triangles or of one sphere."""
        nodes = half_area(self.aabb_min.min(axis=1), self.aabb_max.max(axis=1))
        leaf = self.child < 0
        _, sphere, count = leaf_fields(self.child[leaf])
        leaves = half_area(self.aabb_min[leaf], self.aabb_max[leaf])
        visits = np.any(self.child != EMPTY, axis=1)
        return expected_work(
            np.concatenate([nodes, leaves]), np.concatenate([visits, intersections(count, sphere, pack)])
        )


def leaf_reference(first: IntArray, sphere: BoolArray, count: IntArray) -> IntArray:
    """Return the `child` entries of leaves."""
    return ~(first << 4 | sphere.astype(np.int32) << 3 | count - 1)


def leaf_fields(reference: IntArray) -> tuple[IntArray, BoolArray, IntArray]:
    """Return first, sphere, count of leaf references."""
    bits = ~reference
    return bits >> 4, (bits >> 3 & 1).astype(bool), (bits & 7) + 1


def collapse(tree: Bvh, width: int = 8, pack: int = 1) -> WideBvh:
    """Collapse a binary BVH to the wide one of least expected cost; its leaves stay as they are.

    Dynamic programming over the surface area heuristic (Ylitie, Karras, Laine 2017, "Efficient Incoherent Ray Traversal
    on GPUs Through Compressed Wide BVHs", 3.1): 4 to 6 % less on scans than opening the largest child first. Leaves
    have at most MAX_LEAF primitives. Raises SceneError for more than MAX_PRIMITIVES triangles or spheres.
    """
    largest = max(tree.order.size, tree.sphere_order.size)
    if largest > MAX_PRIMITIVES:
        raise SceneError(f"{largest} primitives of one kind, but a wide BVH holds up to {MAX_PRIMITIVES}; use bvh2")
    if tree.count.max() > MAX_LEAF:
        raise ValueError(f"a leaf of {tree.count.max()} primitives; a leaf reference holds {MAX_LEAF}")
    if tree.empty:
        return _wide(tree, np.full((1, width), -1, np.int32))
    opened, share = _plan(tree, width, pack)
    interior = np.append(~tree.leaf, False)  # slots without a node hold -1, which indexes the extra last entry
    slots, tops = [], np.zeros(1, np.int32)
    while tops.size:
        slots.append(_open(tree, tops, opened, share, width))
        tops = slots[-1][interior[slots[-1]]]
    return _wide(tree, np.concatenate(slots))


def _plan(tree: Bvh, width: int, pack: int) -> tuple[BoolArray, NDArray[np.int8]]:
    """Plan how to represent each node's subtree by at most b roots, b = 0 … width, at the least cost.

    opened: (n + 1, width + 1) bool, whether to replace the node by the roots of its two children.
    share: (n + 1, width + 1) int8, how many of the b roots the left child then gets.

    Least cost with b roots: for a leaf its own; for an opened node, the best split of b between its children; for a
    node that is kept, as one root, its area plus its cost opened with `width` roots.
    """
    area = half_area(tree.aabb_min, tree.aabb_max)
    cost = np.repeat((area * intersections(tree.count, tree.spheres, pack))[:, None], width + 1, axis=1)
    opened = np.zeros((len(area) + 1, width + 1), bool)
    share = np.ones((len(area) + 1, width + 1), np.int8)
    for level in reversed(list(tree.levels())):
        nodes = level[~tree.leaf[level]]
        left, right = cost[tree.left_first[nodes]], cost[tree.left_first[nodes] + 1]
        best = np.full((len(nodes), width + 1), np.inf)
        for b in range(2, width + 1):
            splits = np.stack([left[:, k] + right[:, b - k] for k in range(1, b)])
            share[nodes, b] = 1 + np.argmin(splits, axis=0)
            best[:, b] = splits.min(axis=0)
        kept = area[nodes] + best[:, width]
        opened[nodes] = best < kept[:, None]
        cost[nodes] = np.minimum(best, kept[:, None])
    return opened, share


def _open(tree: Bvh, tops: IntArray, opened: BoolArray, share: NDArray[np.int8], width: int) -> IntArray:
    """Return the binary nodes, (k, width), that become the children of the wide nodes for `tops` (k,)."""
    slots, roots = np.full((len(tops), width), -1, np.int32), np.zeros((len(tops), width), np.intp)
    slots[:, 0], roots[:, 0] = tops, width
    for used in range(1, width):
        pays = opened[slots, roots] if used > 1 else (slots >= 0) & ~np.append(tree.leaf, True)[slots]
        pick = np.argmax(pays, axis=1)
        row = np.flatnonzero(pays[np.arange(len(tops)), pick])
        node, b = slots[row, pick[row]], roots[row, pick[row]]
        slots[row, pick[row]], slots[row, used] = tree.left_first[node], tree.left_first[node] + 1
        roots[row, pick[row]], roots[row, used] = share[node, b], b - share[node, b]
    return slots


def _wide(tree: Bvh, slots: IntArray) -> WideBvh:
    """Return boxes and references for slots (k, width) of binary nodes, whose rows are in breadth-first order."""
    nowhere = np.full((1, 3), np.inf, np.float32)
    leaf = np.append(tree.leaf, False)[slots]
    interior = (slots >= 0) & ~leaf
    nodes = slots[leaf]
    child = np.full(slots.shape, EMPTY, np.int32)
    child[leaf] = leaf_reference(tree.left_first[nodes], tree.spheres[nodes], tree.count[nodes])
    child[interior] = np.arange(1, 1 + np.count_nonzero(interior))
    return WideBvh(
        np.concatenate([tree.aabb_min, nowhere])[slots],
        np.concatenate([tree.aabb_max, -nowhere])[slots],
        child,
        tree.order,
        tree.sphere_order,
    )
