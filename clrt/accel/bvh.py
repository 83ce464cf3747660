"""The binary bounding volume hierarchy (BVH) that every builder makes and every layout packs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float32]
IntArray = NDArray[np.int32]
BoolArray = NDArray[np.bool_]


class Triangles(Protocol):
    """(m, 3, 3) float32 corners: an array, or an object that creates one on conversion, to save memory."""

    def __len__(self) -> int: ...

    def __array__(self, dtype: None = None, /) -> FloatArray: ...


@dataclass(frozen=True, eq=False)
class Bvh:
    """A binary BVH in flat arrays (Nadolny 2026, 5.4.4). Node 0 is the root; children come after their parent.

    A BVH over p primitives has at most 2p − 1 nodes. The empty BVH is one interior node that is its own child and whose
    box is inverted (min +inf, max −inf), so that no ray enters it.

    aabb_min, aabb_max: (n, 3) float32. count: (n,) int32, primitives of a leaf, 0 for an interior node.
    left_first: (n,) int32, the left child (the right one is next to it), or the leaf's first entry in its order.
    spheres: (n,) bool, whether the leaf's entries are in `sphere_order` instead of `order`.
    order, sphere_order: (p,) and (s,) int32, permutations of the triangles and of the spheres.
    """

    aabb_min: FloatArray
    aabb_max: FloatArray
    left_first: IntArray
    count: IntArray
    spheres: BoolArray
    order: IntArray
    sphere_order: IntArray

    @property
    def empty(self) -> bool:
        """Return whether there are no primitives."""
        return self.order.size + self.sphere_order.size == 0

    @property
    def leaf(self) -> BoolArray:
        """Return which nodes are leaves, (n,) bool."""
        return self.count > 0

    def levels(self) -> Iterator[IntArray]:
        """Yield node indices, level by level from the root."""
        nodes = np.zeros(1, np.int32)
        while nodes.size:
            yield nodes
            left = self.left_first[nodes[self.count[nodes] == 0]]
            nodes = left[:0] if self.empty else np.stack([left, left + 1], axis=1).ravel()

    @property
    def depth(self) -> int:
        """Return the number of edges from the root to the deepest leaf."""
        return sum(1 for _ in self.levels()) - 1

    @property
    def stack_bound(self) -> int:
        """Return the maximum stack size of a traversal that pushes both children of a node and then pops the next one.

        One fewer if it keeps the next one in a register. The bound is tight: a node at depth d is popped with at most d
        entries left, one sibling per level, and the deepest interior node, at `depth` − 1, then pushes two.
        """
        return self.depth + 1

    def sah_cost(self, pack: int = 1) -> float:
        """Return the expected cost of a ray that hits the root's box (Nadolny 2026, 2.7): 1 per node, 1 per test.

        `pack` triangles of a leaf are intersected at the cost of one; spheres are not packed.
        """
        return expected_work(
            half_area(self.aabb_min, self.aabb_max),
            np.where(self.leaf, intersections(self.count, self.spheres, pack), not self.empty),
        )


def intersections(count: IntArray, spheres: BoolArray, pack: int) -> IntArray:
    """Return the number of intersection tests per leaf, with `pack` triangles or one sphere per test."""
    return -(-count // np.where(spheres, np.int32(1), np.int32(pack)))


def half_area(aabb_min: FloatArray, aabb_max: FloatArray) -> NDArray[np.float64]:
    """Return half the surface area of boxes, (..., 3) float32 to (...); 0 if inverted. float64, so none overflows."""
    x, y, z = np.moveaxis(np.maximum(aabb_max.astype(np.float64) - aabb_min, 0), -1, 0)
    area: NDArray[np.float64] = x * y + y * z + z * x
    return area


def expected_work(area: NDArray[np.float64], work: NDArray[Any]) -> float:
    """Return the sum of work (n,) weighted by area (n,) relative to the first one's; unweighted if that is 0."""
    return float(np.sum(area / area[0] * work) if area[0] > 0 else np.sum(work))


def empty_tree() -> Bvh:
    """Return the BVH without primitives."""
    nothing, zero, inverted = np.empty(0, np.int32), np.zeros(1, np.int32), np.full((1, 3), np.inf, np.float32)
    return Bvh(inverted, -inverted, zero, zero, np.zeros(1, bool), nothing, nothing)


def join(triangles: Bvh, spheres: Bvh) -> Bvh:
    """Join the BVHs of triangles and spheres under a new root, so that every leaf has one kind only.

    Both come from a builder, which fills `order`; the second one's primitives are spheres.
    """
    spheres = replace(spheres, spheres=spheres.leaf, order=spheres.sphere_order, sphere_order=spheres.order)
    if spheres.empty or triangles.empty:
        return triangles if spheres.empty else spheres

    def merged(root: Any, first: NDArray[Any], second: NDArray[Any]) -> NDArray[Any]:
        return np.concatenate([np.array([root], first.dtype), first[:1], second[:1], first[1:], second[1:]])

    def shifted(tree: Bvh, shift: int) -> IntArray:
        return np.where(tree.leaf, tree.left_first, tree.left_first + np.int32(shift))

    return Bvh(
        aabb_min=merged(np.minimum(triangles.aabb_min[0], spheres.aabb_min[0]), triangles.aabb_min, spheres.aabb_min),
        aabb_max=merged(np.maximum(triangles.aabb_max[0], spheres.aabb_max[0]), triangles.aabb_max, spheres.aabb_max),
        left_first=merged(1, shifted(triangles, 2), shifted(spheres, 1 + len(triangles.count))),
        count=merged(0, triangles.count, spheres.count),
        spheres=merged(False, triangles.spheres, spheres.spheres),
        order=triangles.order,
        sphere_order=spheres.sphere_order,
    )
