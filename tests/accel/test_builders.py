"""Every builder makes a valid BVH of bounded depth from any boxes; `sah` finds the cheapest splits."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from clrt.accel.builders import BUILDERS, midpoint, sah
from clrt.accel.bvh import Bvh, FloatArray, half_area, join

from ..covering import others
from .cases import NASTY, grid, soup, spheres

Builder = Callable[[FloatArray, FloatArray, int, int], Bvh]
CONFIGURATIONS = [("sah", 4, 1), ("sah", 8, 8), ("sah", 1, 1), ("midpoint", 2, 1), ("midpoint", 8, 8)]


def check(tree: Bvh, low: FloatArray, high: FloatArray, leaf_size: int, free_depth: int = 40) -> None:
    """Assert that the BVH over boxes (p, 3) is valid and not too deep."""
    count, nodes = len(low), len(tree.count)
    assert nodes <= max(2 * count - 1, 1)
    if not count:
        return
    inner, leaf = np.flatnonzero(~tree.leaf), np.flatnonzero(tree.leaf)
    children = np.concatenate([tree.left_first[inner], tree.left_first[inner] + 1])
    np.testing.assert_array_equal(np.sort(children), np.arange(1, nodes))
    assert (tree.left_first[inner] > inner).all()

    assert tree.count.max() <= leaf_size
    leaf = leaf[np.argsort(tree.left_first[leaf])]
    first, size = tree.left_first[leaf], tree.count[leaf]
    np.testing.assert_array_equal(np.append(first, count), np.append(0, np.cumsum(size)))
    np.testing.assert_array_equal(np.sort(tree.order), np.arange(count))

    for union, box, boxes in ((np.minimum, tree.aabb_min, low), (np.maximum, tree.aabb_max, high)):
        np.testing.assert_array_equal(box[leaf], union.reduceat(boxes[tree.order], first))
        left = tree.left_first[inner]
        np.testing.assert_array_equal(box[inner], union(box[left], box[left + 1]))
    assert tree.depth <= free_depth + math.ceil(math.log2(count))


@pytest.mark.parametrize("case", NASTY)
@pytest.mark.parametrize("builder, leaf_size, pack", CONFIGURATIONS)
def test_any_soup_gives_a_sound_tree(builder: str, leaf_size: int, pack: int, case: str) -> None:
    low, high = NASTY[case].min(axis=1), NASTY[case].max(axis=1)
    check(BUILDERS[builder](low, high, leaf_size, pack), low, high, leaf_size)


COORDINATES = st.floats(width=32, allow_nan=False, allow_infinity=False) | st.sampled_from([-1.0, -0.0, 0.0, 1.0, 2.0])


@settings(deadline=None)
@given(
    corners=st.integers(1, 40).flatmap(lambda count: arrays(np.float32, (count, 2, 3), elements=COORDINATES)),
    configuration=st.sampled_from(CONFIGURATIONS),
)
def test_any_finite_boxes_give_a_sound_tree(corners: FloatArray, configuration: tuple[str, int, int]) -> None:
    low, high = corners.min(axis=1), corners.max(axis=1)
    builder, leaf_size, pack = configuration
    check(BUILDERS[builder](low, high, leaf_size, pack), low, high, leaf_size)


@pytest.mark.parametrize("triangles", [soup(60_000, 0.01), *others(grid(316))], ids=["soup", "200 k in a plane"])
def test_many_nodes_and_batches(triangles: FloatArray) -> None:
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    check(sah(low, high, 1), low, high, 1)


def test_midpoint_keeps_apart_what_the_middle_of_the_longest_axis_parts() -> None:
    centers = np.zeros((6, 3), np.float32)
    centers[:, 1] = [9, 0, 1, 10, 3, 2]
    tree = midpoint(centers - 0.25, centers + 0.25)
    left, right = tree.aabb_max[1], tree.aabb_min[2]
    assert (left[1], right[1]) == (3.25, 8.75)


@pytest.mark.parametrize("gap, nodes", [(0, 1), (1, 3)])
def test_a_node_is_cut_where_that_pays(gap: float, nodes: int) -> None:
    """Two unit cubes, half areas 3 each and 5 + 2·gap together: a leaf costs twice that, a split once that plus 6."""
    x = np.zeros((2, 3), np.float32)
    x[1, 0] = 1 + gap
    assert len(sah(x, x + 1, 2).count) == nodes


def test_cost_of_a_tree_by_hand() -> None:
    """Unit cubes at x = 0 and 2: half areas 3 each, 7 for the root; 3 primitives left, 1 right."""
    x = np.zeros((4, 3), np.float32)
    x[3, 0] = 2
    tree = sah(x, x + 1, 3)
    assert len(tree.count) == 3
    assert tree.sah_cost() == pytest.approx(1 + (3 * 3 + 3 * 1) / 7)
    assert tree.sah_cost(pack=2) == pytest.approx(1 + (3 * 2 + 3 * 1) / 7)
    assert sah(x[:1], x[:1] + 1, 3).sah_cost() == 1


def sweep_cost(low: NDArray[np.float64], high: NDArray[np.float64], leaf_size: int, pack: int) -> float:
    """Return SAH cost times half area of the BVH that tries every split of the sorted centroids on every axis."""

    def area(low: NDArray[np.float64], high: NDArray[np.float64]) -> float:
        x, y, z = high.max(axis=0) - low.min(axis=0)
        return float(x * y + y * z + z * x)

    count = len(low)
    as_leaf = area(low, high) * math.ceil(count / pack)
    if count == 1:
        return as_leaf
    best, parts = math.inf, (np.arange(0), np.arange(0))
    for axis in range(3):
        order = np.argsort(low[:, axis] + high[:, axis], kind="stable")
        for cut in range(1, count):
            left, right = order[:cut], order[cut:]
            cost = area(low[left], high[left]) * math.ceil(cut / pack) + area(low[right], high[right]) * math.ceil(
                (count - cut) / pack
            )
            if cost < best:
                best, parts = cost, (left, right)
    if count <= leaf_size and as_leaf <= area(low, high) + best:
        return as_leaf
    return area(low, high) + sum(sweep_cost(low[part], high[part], leaf_size, pack) for part in parts)


@pytest.mark.parametrize("leaf_size, pack", [(1, 1), (4, 1), (8, 8)])
@pytest.mark.parametrize("size", [0.02, 0.3])
def test_no_other_cuts_cost_less(leaf_size: int, pack: int, size: float) -> None:
    triangles = soup(300, size, seed=5)
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    work = sweep_cost(low.astype(np.float64), high.astype(np.float64), leaf_size, pack)
    reference = work / float(half_area(low.min(axis=0), high.max(axis=0)))
    assert sah(low, high, leaf_size, pack).sah_cost(pack) == pytest.approx(reference, rel=1e-9)
    assert reference < midpoint(low, high, leaf_size).sah_cost(pack)


@pytest.mark.parametrize("triangle_count, sphere_count", [(0, 0), (0, 9), (9, 0), (1, 1), (50, 20)])
def test_joined_trees_keep_their_leaves(triangle_count: int, sphere_count: int) -> None:
    triangles, balls = soup(triangle_count), spheres(sphere_count)
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    ball_low, ball_high = balls[:, :3] - balls[:, 3:], balls[:, :3] + balls[:, 3:]
    tree = join(sah(low, high, 4), midpoint(ball_low, ball_high))
    # With the spheres renumbered after the triangles, the joined BVH is a valid BVH over both.
    both = Bvh(
        tree.aabb_min,
        tree.aabb_max,
        np.where(tree.spheres, tree.left_first + triangle_count, tree.left_first).astype(np.int32),
        tree.count,
        tree.spheres,
        np.concatenate([tree.order, tree.sphere_order + triangle_count]).astype(np.int32),
        tree.sphere_order[:0],
    )
    check(both, np.concatenate([low, ball_low]), np.concatenate([high, ball_high]), 4)
    assert not tree.spheres[tree.count == 0].any()
    assert tree.count[tree.spheres].sum() == sphere_count
