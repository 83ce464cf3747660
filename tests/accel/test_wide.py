"""Collapsing to a wide BVH keeps the leaves and has the least possible cost, and the stack bounds are exact."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from clrt.accel.builders import BUILDERS, midpoint, sah
from clrt.accel.bvh import Bvh, IntArray, empty_tree, half_area, join
from clrt.accel.wide import EMPTY, MAX_PRIMITIVES, WideBvh, collapse, leaf_fields
from clrt.errors import SceneError

from .cases import NASTY, soup, spheres

Children = list[list[int]]  # of every node; a leaf is -1


def mixed_tree(count: int, seed: int = 0) -> Bvh:
    triangles, balls = soup(count, seed=seed), spheres(count // 3, seed)
    return join(
        sah(triangles.min(axis=1), triangles.max(axis=1), 8, 8),
        midpoint(balls[:, :3] - balls[:, 3:], balls[:, :3] + balls[:, 3:]),
    )


@pytest.mark.parametrize("width", [2, 4, 8])
@pytest.mark.parametrize("count", [0, 1, 9, 30, 2000])
def test_leaves_and_their_boxes_stay(count: int, width: int) -> None:
    tree = mixed_tree(count)
    wide = collapse(tree, width)
    leaf = wide.child < 0
    first, sphere, size = leaf_fields(wide.child[leaf])
    found = zip(first, sphere, size, wide.aabb_min[leaf].tolist(), wide.aabb_max[leaf].tolist())
    expected = zip(
        tree.left_first[tree.leaf],
        tree.spheres[tree.leaf],
        tree.count[tree.leaf],
        tree.aabb_min[tree.leaf].tolist(),
        tree.aabb_max[tree.leaf].tolist(),
    )
    assert sorted(found) == sorted(expected)

    np.testing.assert_array_equal(wide.child[wide.interior], np.arange(1, len(wide.child)))
    below = wide.child[wide.interior]
    np.testing.assert_array_equal(wide.aabb_min[wide.interior], wide.aabb_min[below].min(axis=1))
    np.testing.assert_array_equal(wide.aabb_max[wide.interior], wide.aabb_max[below].max(axis=1))

    unused = wide.child == EMPTY
    assert not (unused[:, :-1] & ~unused[:, 1:]).any()
    assert (wide.aabb_min[unused] == np.inf).all() and (wide.aabb_max[unused] == -np.inf).all()


def least_cost(tree: Bvh, width: int) -> float:
    """Return the least cost over all sets of interior nodes, with the root, that have at most `width` children each."""
    area = half_area(tree.aabb_min, tree.aabb_max)
    below = [int(node) for node in np.flatnonzero(~tree.leaf) if node]

    def children(node: int, kept: set[int]) -> int:
        """Return how many slots the subtree below `node` takes in its wide node."""
        first = int(tree.left_first[node])
        return sum(1 if tree.count[child] or child in kept else children(child, kept) for child in (first, first + 1))

    leaves = float(np.sum(area[tree.leaf] * tree.count[tree.leaf]))
    costs = [
        leaves + float(sum(area[list(kept)]))
        for size in range(len(below) + 1)
        for kept in ({0, *chosen} for chosen in combinations(below, size))
        if all(children(node, kept) <= width for node in kept)
    ]
    return min(costs) / float(area[0])


@pytest.mark.parametrize("width", [2, 3, 4, 8])
@pytest.mark.parametrize("seed", range(6))
def test_no_wide_tree_costs_less(seed: int, width: int) -> None:
    triangles = soup(11, seed=seed)
    tree = midpoint(triangles.min(axis=1), triangles.max(axis=1), 1)
    assert collapse(tree, width).sah_cost() == pytest.approx(least_cost(tree, width), rel=1e-9)


def binary_children(tree: Bvh) -> Children:
    return [
        [] if count else [child if tree.count[child] == 0 else -1 for child in (first, first + 1)]
        for first, count in zip(tree.left_first.tolist(), tree.count.tolist())
    ]


def wide_children(wide: WideBvh) -> Children:
    return [[max(child, -1) for child in row if child != EMPTY] for row in wide.child.tolist()]


def fullest_stack(children: Children) -> int:
    """Return the fullest stack over all nodes when the node has pushed its children and was reached directly."""
    parent = {child: node for node, below in enumerate(children) for child in below if child >= 0}
    fullest = 1
    for target in range(len(children)):
        path = [target]
        while path[-1]:
            path.append(parent[path[-1]])
        stack = [0]
        for node, towards in zip(path[::-1], [*path[-2::-1], -1]):
            assert stack.pop() == node
            others = list(children[node])
            if towards >= 0:
                others.remove(towards)
                others.append(towards)
            stack += others
            fullest = max(fullest, len(stack))
    return fullest


@settings(deadline=None)
@given(
    count=st.integers(1, 150),
    seed=st.integers(0, 10_000),
    builder=st.sampled_from(sorted(BUILDERS)),
    leaf_size=st.integers(1, 8),
    size=st.sampled_from([0.001, 0.1, 3.0]),
)
def test_stack_bounds_are_exact(count: int, seed: int, builder: str, leaf_size: int, size: float) -> None:
    triangles = soup(count, size, seed)
    tree = BUILDERS[builder](triangles.min(axis=1), triangles.max(axis=1), leaf_size, 1)
    # Leaves of the binary BVH push no children, so only interior nodes are targets.
    inner = np.flatnonzero(~tree.leaf)
    number, below = {int(node): i for i, node in enumerate(inner)}, binary_children(tree)
    children = [[number.get(child, -1) for child in below[node]] for node in inner]
    assert tree.stack_bound == fullest_stack(children)
    wide = collapse(tree)
    assert wide.stack_bound == fullest_stack(wide_children(wide))


@pytest.mark.parametrize("case", ["exponential", "teapot_in_a_stadium", "long_diagonals", "duplicates"])
def test_no_order_of_visits_passes_the_bound(case: str) -> None:
    triangles = NASTY[case]
    wide = collapse(sah(triangles.min(axis=1), triangles.max(axis=1), 8, 8))
    children, rng = wide_children(wide), np.random.default_rng(1)
    fullest = 0
    for _ in range(20):
        stack = [0]
        while stack:
            fullest = max(fullest, len(stack))
            node = stack.pop()
            if node >= 0:
                stack += rng.permutation(children[node]).tolist()
    assert 1 < fullest <= wide.stack_bound


def test_cost_of_a_wide_tree_by_hand() -> None:
    """Ten unit cubes in a row with gaps: half areas 3 each, 19 + 19 + 1 for the whole; one node over two leaves."""
    x = np.zeros((10, 3), np.float32)
    x[:, 0] = 2 * np.arange(10)
    tree = midpoint(x, x + 1, 5)
    wide = collapse(tree)
    assert len(wide.child) == 1
    assert wide.sah_cost(pack=5) == pytest.approx(1 + 2 * (9 + 9 + 1) / 39)
    assert wide.sah_cost() == pytest.approx(1 + 2 * 5 * (9 + 9 + 1) / 39)


def test_nothing() -> None:
    tree = empty_tree()
    wide = collapse(tree)
    assert (wide.child == EMPTY).all() and wide.child.shape == (1, 8)
    assert (tree.depth, wide.depth, tree.stack_bound, wide.stack_bound) == (0, 0, 1, 1)
    assert tree.sah_cost() == wide.sah_cost() == 0


def test_what_a_reference_cannot_say_is_refused() -> None:
    tree = mixed_tree(9)
    nine: IntArray = np.where(tree.leaf, 9, 0).astype(np.int32)
    with pytest.raises(ValueError, match="leaf of 9"):
        collapse(replace(tree, count=nine))
    many: IntArray = np.broadcast_to(np.zeros(1, np.int32), MAX_PRIMITIVES + 1)
    with pytest.raises(SceneError, match="use bvh2"):
        collapse(replace(tree, order=many))
