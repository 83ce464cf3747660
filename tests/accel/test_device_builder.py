"""Trees built on every device: sound, of least cost for their clusters, and everywhere the same."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

from clrt.accel.layouts import sphere_boxes
from clrt.accel.wide import EMPTY, leaf_fields
from clrt.device.open import Device

from .cases import SCENES
from .device_trees import built


@pytest.mark.parametrize("case", SCENES)
def test_nodes_form_a_tree_in_breadth_first_order(device: Device, case: str) -> None:
    tree, wide = built(device, case).tree, built(device, case).wide
    unused = wide.child == EMPTY
    assert not unused[:, :2].any() and not (unused[:, :-1] & ~unused[:, 1:]).any()
    np.testing.assert_array_equal(wide.child[wide.interior], np.arange(1, len(wide.child)))
    assert tree.level_sizes == [len(level) for level in wide.levels()]
    assert tree.stack == wide.stack_bound


@pytest.mark.parametrize("case", SCENES)
def test_every_primitive_is_in_one_leaf(device: Device, case: str) -> None:
    found, (triangles, balls) = built(device, case), SCENES[case]
    first, sphere, count = leaf_fields(found.wide.child[found.wide.child < 0])
    np.testing.assert_array_equal(np.sort(first[~sphere]), 8 * np.arange(len(found.packs)))
    spans = np.sort(first[sphere]), count[sphere][np.argsort(first[sphere])]
    np.testing.assert_array_equal(np.append(spans[0], len(balls)), np.append(0, np.cumsum(spans[1])))

    live = np.zeros(found.packs["primitive"].shape, bool)
    live[first[~sphere] // 8] = np.arange(8) < count[~sphere, None]
    primitive = found.packs["primitive"]
    np.testing.assert_array_equal(np.sort(primitive[live]), np.arange(len(triangles)))
    assert (primitive[~live] == -1).all()
    for corner, name in enumerate(("p0", "p1", "p2")):
        lanes = found.packs[name].transpose(0, 2, 1)
        np.testing.assert_array_equal(lanes[live], triangles[primitive[live], corner])
        assert np.isnan(lanes[~live]).all()

    np.testing.assert_array_equal(np.sort(found.wide.sphere_order), np.arange(len(balls)))
    np.testing.assert_array_equal(found.spheres["center"], balls[found.wide.sphere_order, :3])
    np.testing.assert_array_equal(found.spheres["radius"], balls[found.wide.sphere_order, 3])


@pytest.mark.parametrize("case", SCENES)
def test_boxes_are_tight(device: Device, case: str) -> None:
    found, wide = built(device, case), built(device, case).wide
    first, sphere, _ = leaf_fields(wide.child)
    triangles, balls = (wide.child < 0) & ~sphere, (wide.child < 0) & sphere
    corners = np.concatenate([found.packs[name] for name in ("p0", "p1", "p2")], axis=2)
    bounds = sphere_boxes(SCENES[case][1][wide.sphere_order])
    for boxes, union, ends, edges in ((wide.aabb_min, np.minimum, np.fmin.reduce(corners, axis=2), bounds[0]),
                                      (wide.aabb_max, np.maximum, np.fmax.reduce(corners, axis=2), bounds[1])):
        np.testing.assert_array_equal(boxes[triangles], ends[first[triangles] // 8])
        if balls.any():
            order = np.argsort(first[balls])
            np.testing.assert_array_equal(boxes[balls][order], union.reduceat(edges, first[balls][order]))
        np.testing.assert_array_equal(boxes[wide.interior], union.reduce(boxes[1:], axis=1))
    unused = wide.child == EMPTY
    assert (wide.aabb_min[unused] == np.inf).all() and (wide.aabb_max[unused] == -np.inf).all()


@lru_cache(maxsize=None)
def first_result(case: str) -> list[bytes]:
    """Of whichever device asks first."""
    return []


@pytest.mark.parametrize("case", SCENES)
def test_the_same_tree_again_and_everywhere(device: Device, case: str) -> None:
    expected = first_result(case)
    for found in (built(device, case), built.__wrapped__(device, case)):
        expected += [found.nodes.tobytes(), found.packs.tobytes(), found.spheres.tobytes()]
        assert expected[-3:] == expected[:3]
