"""BVHs built on every device, layout bvh8: valid, tight, ordered, and identical on all devices."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.accel.build import build_tree
from clrt.accel.device_builder import SHAPES
from clrt.accel.layouts import LEAF_SPHERE, TRIANGLE_PACK, sphere_boxes
from clrt.accel.wide import EMPTY, MAX_PRIMITIVES, leaf_fields
from clrt.device.launches.device_arrays import on_host
from clrt.device.open import Device
from clrt.errors import SceneError

from ..covering import covering
from .cases import NO_SPHERES, SCENES, edges
from .device_trees import built, like_gpu, wide_tree


def records(device: Device, case: str, name: str, dtype: np.dtype[np.void]) -> NDArray[np.void]:
    """Return a buffer of the layout bvh8, empty if there is none."""
    return np.asarray(built(device, "bvh8", case).buffers.get(name, np.empty(0, dtype)))


@pytest.mark.parametrize("case", SCENES)
def test_nodes_form_a_tree_in_breadth_first_order(device: Device, case: str) -> None:
    tree, wide = built(device, "bvh8", case), wide_tree(device, "bvh8", case)
    unused = wide.child == EMPTY
    assert not unused[:, :2].any() and not (unused[:, :-1] & ~unused[:, 1:]).any()
    np.testing.assert_array_equal(wide.child[wide.interior], np.arange(1, len(wide.child)))
    assert tree.level_sizes == tuple(len(level) for level in wide.levels())
    assert (tree.stack, tree.depth, tree.nodes) == (wide.stack_bound, wide.depth, len(wide.child))
    assert tree.sah_cost == pytest.approx(wide.sah_cost(8), rel=1e-5)


@pytest.mark.parametrize("case", SCENES)
def test_every_primitive_is_in_one_leaf(device: Device, case: str) -> None:
    wide, (triangles, balls) = wide_tree(device, "bvh8", case), SCENES[case]
    packs = records(device, case, "packs", TRIANGLE_PACK)
    leaf_spheres = records(device, case, "leaf_spheres", LEAF_SPHERE)
    first, sphere, count = leaf_fields(wide.child[wide.child < 0])
    np.testing.assert_array_equal(np.sort(first[~sphere]), 8 * np.arange(len(packs)))
    spans = np.sort(first[sphere]), count[sphere][np.argsort(first[sphere])]
    np.testing.assert_array_equal(np.append(spans[0], len(balls)), np.append(0, np.cumsum(spans[1])))

    live = np.zeros(packs["primitive"].shape, bool)
    live[first[~sphere] // 8] = np.arange(8) < count[~sphere, None]
    np.testing.assert_array_equal(np.sort(packs["primitive"][live]), np.arange(len(triangles)))
    assert (packs["primitive"][~live] == -1).all()
    for corner, name in enumerate(("p0", "p1", "p2")):
        lanes = packs[name].transpose(0, 2, 1)
        np.testing.assert_array_equal(lanes[live], triangles[packs["primitive"][live], corner])
        assert np.isnan(lanes[~live]).all()

    np.testing.assert_array_equal(np.sort(wide.sphere_order), np.arange(len(balls)))
    np.testing.assert_array_equal(leaf_spheres["center"], balls[wide.sphere_order, :3])
    np.testing.assert_array_equal(leaf_spheres["radius"], balls[wide.sphere_order, 3])


@pytest.mark.parametrize("case", SCENES)
def test_boxes_are_tight(device: Device, case: str) -> None:
    wide, packs = wide_tree(device, "bvh8", case), records(device, case, "packs", TRIANGLE_PACK)
    first, sphere, _ = leaf_fields(wide.child)
    triangles, balls = (wide.child < 0) & ~sphere, (wide.child < 0) & sphere
    corners = np.stack([packs[name] for name in ("p0", "p1", "p2")]).transpose(1, 3, 0, 2)
    low, high = (each.reshape(-1, 8, 3) for each in edges(corners.reshape(-1, 3, 3)))
    bounds = sphere_boxes(SCENES[case][1][wide.sphere_order])
    for boxes, union, ends, sides in (
        (wide.aabb_min, np.minimum, np.fmin.reduce(low, axis=1), bounds[0]),
        (wide.aabb_max, np.maximum, np.fmax.reduce(high, axis=1), bounds[1]),
    ):
        np.testing.assert_array_equal(boxes[triangles], ends[first[triangles] // 8])
        if balls.any():
            order = np.argsort(first[balls])
            np.testing.assert_array_equal(boxes[balls][order], union.reduceat(sides, first[balls][order]))
        np.testing.assert_array_equal(boxes[wide.interior], union.reduce(boxes[1:], axis=1))
    unused = wide.child == EMPTY
    assert (wide.aabb_min[unused] == np.inf).all() and (wide.aabb_max[unused] == -np.inf).all()


def test_walls_of_a_room_do_not_share_a_leaf(device: Device) -> None:
    """A leaf with several walls would be as large as the room, and every ray would enter it."""
    wide = wide_tree(device, "bvh8", "room")
    leaf = wide.child < 0
    size = wide.aabb_max[leaf].astype(np.float64) - wide.aabb_min[leaf]
    assert (size.min(axis=1) < 0.5 * size.max()).all()


@cache
def first_result(layout: str, case: str) -> list[dict[str, bytes]]:
    """Hold the result of the device that is tested first."""
    return []


@covering("case, layout", SCENES, SHAPES)
def test_the_same_tree_again_and_everywhere(device: Device, layout: str, case: str) -> None:
    again = build_tree(device, layout, "ploc", *SCENES[case]).buffers
    for buffers in (built(device, layout, case).buffers, again):
        first_result(layout, case).append({name: on_host(device, a).tobytes() for name, a in buffers.items()})
        assert first_result(layout, case)[-1] == first_result(layout, case)[0]


@pytest.mark.programs
@covering("case, layout", ["blocks", "mixed", "two", "equal_centroids"], SHAPES)
def test_the_same_tree_by_many_work_items(device: Device, layout: str, case: str) -> None:
    found = build_tree(like_gpu(device), layout, "ploc", *SCENES[case])
    expected = built(device, layout, case)
    for name, array in found.buffers.items():
        assert on_host(device, array).tobytes() == expected.buffers[name].tobytes()
    assert found.sah_cost == pytest.approx(expected.sah_cost, rel=1e-5)


def test_more_than_a_reference_can_say_is_refused(device: Device) -> None:
    many = np.broadcast_to(np.zeros((1, 3, 3), np.float32), (MAX_PRIMITIVES + 1, 3, 3))
    with pytest.raises(SceneError, match="use the builder sah"):
        build_tree(device, "bvh2", "ploc", many, NO_SPHERES)
