"""Steps of the device builder: prefix sums, radix sort, Morton curve, clustering, and wide-BVH plan."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.accel import ploc
from clrt.accel.bvh import FloatArray, half_area, intersections
from clrt.accel.device_builder import SHAPES, BuilderLayout, program_source
from clrt.accel.layouts import sphere_boxes
from clrt.accel.morton import CODE_BITS, radix_sort, sort_primitives
from clrt.accel.ploc import SLOW
from clrt.accel.wide import leaf_fields
from clrt.device.launches.data_parallel import DataParallel
from clrt.device.open import Device

from ..covering import covering
from .cases import SCENES, edges
from .device_trees import Binary, binary, binary_tree, like_gpu, wide_tree


@pytest.mark.parametrize("case", SCENES)
def test_clusters_form_a_tree_of_bounded_depth(device: Device, case: str) -> None:
    """A round that merges fewer than one in SLOW is followed by one that merges half."""
    tree = binary(device, "bvh8", case)
    tree.check()
    most = max(2 * math.log2(len(tree.sphere)), math.log(len(tree.sphere)) / -math.log(1 - 1 / SLOW))
    assert len(tree.rounds) <= most + 3


@covering("case, gpu", SCENES, [False, True])
def test_the_last_rounds_are_those_of_many(
    device: Device, case: str, gpu: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One work-group, of one item or many, makes the same nodes as one launch per round."""
    device = like_gpu(device) if gpu else device
    few = binary(device, "bvh8", case)
    monkeypatch.setattr(ploc, "FEW", 2)
    many = binary(device, "bvh8", case)
    assert few.rounds == many.rounds
    np.testing.assert_array_equal(few.nodes, many.nodes)


def chance(low: NDArray[Any], high: NDArray[Any], scene_low: NDArray[Any], scene_high: NDArray[Any]) -> NDArray[Any]:
    """Return the probability that a ray that starts inside the scene hits each box: starts in it, or reaches it."""
    size = scene_high.astype(np.float64) - scene_low
    volume = np.prod(np.where(size > 0, (high.astype(np.float64) - low) / np.where(size > 0, size, 1), 1), axis=-1)
    return np.asarray(volume + (1 - volume) * half_area(low, high) / half_area(scene_low, scene_high) / 2)


def least_work(tree: Binary, shape: BuilderLayout) -> float:
    """Return the cost of the cheapest wide BVH cut from the binary one; a pack is opened only if that saves a fifth."""
    count, low, high = len(tree.sphere), tree.nodes["lo"], tree.nodes["hi"]
    met = chance(np.concatenate([tree.low, low]), np.concatenate([tree.high, high]), low[-1], high[-1])
    size, balls = np.ones(2 * count - 1, np.intp), np.concatenate([tree.sphere, np.zeros(count - 1, np.intp)])
    cost, least = np.repeat(met[:, None], shape.children + 1, axis=1), met.copy()
    for node, (a, b) in enumerate(tree.below, start=count):
        size[node], balls[node] = size[a] + size[b], balls[a] + balls[b]
        fits = size[node] <= shape.leaf_size and balls[node] in (0, size[node]) and node < 2 * count - 2
        leaf = met[node] * (size[node] if balls[node] else math.ceil(size[node] / shape.pack)) if fits else np.inf
        best = [min(cost[a, k] + cost[b, many - k] for k in range(1, many)) for many in range(2, shape.children + 1)]
        opened = met[node] + best[-1]
        if fits and shape.pack > 1 and least[a] + least[b] >= 0.8 * leaf:
            cost[node], least[node] = leaf, min(leaf, least[a] + least[b])
        else:
            cost[node] = min(leaf, opened)
            cost[node, 2:] = np.minimum(best, cost[node, 1])
            least[node] = cost[node, shape.children - 1]
    return float(opened)


def boxes_and_visits(device: Device, layout: str, case: str) -> tuple[FloatArray, FloatArray, NDArray[Any]]:
    """Return (n, 3) boxes of nodes, the root's first, and of leaves; and the cost of each visit (n,)."""
    if layout == "bvh2":
        tree = binary_tree(device, case)
        return tree.aabb_min, tree.aabb_max, np.where(tree.leaf, tree.count, 1)
    wide = wide_tree(device, layout, case)
    leaf = wide.child < 0
    _, sphere, count = leaf_fields(wide.child[leaf])
    return (
        np.concatenate([wide.aabb_min.min(axis=1), wide.aabb_min[leaf]]),
        np.concatenate([wide.aabb_max.max(axis=1), wide.aabb_max[leaf]]),
        np.concatenate([np.ones(len(leaf)), intersections(count, sphere, SHAPES[layout].pack)]),
    )


@pytest.mark.parametrize("case", ["nine", "spheres", "long_diagonals", "duplicates", "teapot_in_a_stadium", "room"])
@pytest.mark.parametrize("layout", SHAPES)
def test_no_wide_tree_over_the_same_clusters_costs_less(device: Device, layout: str, case: str) -> None:
    low, high, visits = boxes_and_visits(device, layout, case)
    expected = least_work(binary(device, layout, case), SHAPES[layout])
    assert (chance(low, high, low[0], high[0]) * visits).sum() == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("count", [1, 200, 5000])
@pytest.mark.parametrize("bits", [0, 1, 20, CODE_BITS])
@pytest.mark.parametrize("groups", [False, True])
def test_codes_are_sorted_and_equal_ones_stay_in_order(device: Device, groups: bool, bits: int, count: int) -> None:
    work = DataParallel(like_gpu(device) if groups else device, program_source(SHAPES["bvh8"], True, False, False))
    codes = np.random.default_rng(bits).integers(1 << bits, size=count, dtype=np.uint64)
    sorted_codes, values = radix_sort(work, work.upload(codes), work.upload(np.arange(count, dtype=np.uint32)), count)
    order = np.argsort(codes, kind="stable")
    np.testing.assert_array_equal(work.download(sorted_codes, np.uint64, count), codes[order])
    np.testing.assert_array_equal(work.download(values, np.uint32, count), order)


@pytest.mark.parametrize("count, arrays", [(1, 1), (300, 3), (70_001, 2)])
@pytest.mark.parametrize("groups", [False, True])
def test_sums_of_what_stands_before(device: Device, groups: bool, count: int, arrays: int) -> None:
    work = DataParallel(like_gpu(device) if groups else device, program_source(SHAPES["bvh8"], True, False, False))
    values = np.random.default_rng(0).integers(1000, size=(arrays, count), dtype=np.uint32)
    array = work.upload(values)
    work.scan(array, count, arrays)
    assert work.sums(arrays) == values.sum(axis=1).tolist()
    np.testing.assert_array_equal(
        work.download(array, np.uint32, values.size).reshape(values.shape), np.cumsum(values, axis=1) - values
    )


@pytest.mark.parametrize("case", ["mixed", "flat_grid", "points"])
def test_primitives_follow_the_morton_curve(device: Device, case: str) -> None:
    triangles, balls = SCENES[case]
    low, high = (np.concatenate(each) for each in zip(edges(triangles), sphere_boxes(balls)))
    twice = low + high
    extent = np.ptp(twice, axis=0).max()
    cell = (twice - twice.min(axis=0)) * np.float32((2**21 - 1) / extent if extent else 0)
    place = np.arange(21, dtype=np.uint64)[:, None]
    bits = np.minimum(cell, 2**21 - 1).astype(np.uint64)[:, None] >> place & np.uint64(1)
    code = (bits << np.arange(63, dtype=np.uint64).reshape(21, 3)[:, ::-1]).sum(axis=(1, 2))
    order = np.argsort(code, kind="stable")

    work = DataParallel(device, program_source(SHAPES["bvh8"], True, len(balls) > 0, False))
    primitives = sort_primitives(work, triangles, balls)
    np.testing.assert_array_equal(work.download(primitives.ids, np.uint32, primitives.count), order)
    shapes = work.download(primitives.shapes, np.float32, 9 * primitives.count).reshape(-1, 9)
    sphere = order >= len(triangles)
    np.testing.assert_array_equal(shapes[~sphere], triangles.reshape(-1, 9)[order[~sphere]])
    np.testing.assert_array_equal(shapes[sphere, :4], balls[order[sphere] - len(triangles)])
