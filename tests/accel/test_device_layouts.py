"""The layouts bvh2 and cwbvh built on every device: valid, and in the format of numpy's packers."""

from __future__ import annotations

import numpy as np
import pytest

import clrt
from clrt.accel.bvh import half_area
from clrt.accel.cwbvh import MAX_LEAF, stack_bound
from clrt.accel.device_builder import SHAPES
from clrt.accel.layouts import Layout, sphere_boxes
from clrt.accel.wide import EMPTY
from clrt.device.open import Device

from ..covering import others
from .cases import SCENES, edges, soup
from .device_trees import binary_tree, built, wide_tree
from .test_builders import check
from .test_cwbvh import check_said_once

#: The builder of spheres alone is a program of its own: it is tested with the layout bvh8 by default.
SPHERES = ("spheres", "equal_spheres")
CASES = [case for case in SCENES if case not in SPHERES]
#: By default every other case is built in one of the layouts, and the rest in the other.
OF_TWO = [*CASES[::2], *others(*CASES[1::2], *SPHERES)]
COMPRESSED = [*CASES[1::2], *others(*CASES[::2], *SPHERES)]


def check_leaf_records(layout: Layout, case: str) -> None:
    """Assert that every primitive has one record, with the scene's data."""
    triangles, balls = SCENES[case]
    if len(triangles):
        records = layout.buffers["leaf_triangles"]
        np.testing.assert_array_equal(np.sort(records["primitive"]), np.arange(len(triangles)))
        corners = np.stack([records[name] for name in ("p0", "p1", "p2")], axis=1)
        np.testing.assert_array_equal(corners, triangles[records["primitive"]])
    if len(balls):
        records = layout.buffers["leaf_spheres"]
        np.testing.assert_array_equal(np.sort(records["primitive"]), len(triangles) + np.arange(len(balls)))
        np.testing.assert_array_equal(
            np.column_stack([records["center"], records["radius"]]), balls[records["primitive"] - len(triangles)]
        )


@pytest.mark.parametrize("case", OF_TWO)
def test_nodes_of_two_children(device: Device, case: str) -> None:
    layout, (triangles, balls) = built(device, "bvh2", case), SCENES[case]
    tree, unused = binary_tree(device, case), layout.buffers["nodes"][1]
    assert (unused["aabb_min"] == np.inf).all() and (unused["aabb_max"] == -np.inf).all()
    check_leaf_records(layout, case)
    low, high = (np.concatenate(each) for each in zip(edges(triangles), sphere_boxes(balls)))
    check(tree, low, high, leaf_size=4, free_depth=64)
    assert layout.level_sizes == tuple(len(level) for level in tree.levels())
    assert (layout.stack, layout.depth, layout.nodes) == (tree.stack_bound, tree.depth, len(tree.count))
    assert layout.sah_cost == pytest.approx(tree.sah_cost(), rel=1e-5)


@pytest.mark.parametrize("case", COMPRESSED)
def test_compressed_nodes(device: Device, case: str) -> None:
    layout, (triangles, balls) = built(device, "cwbvh", case), SCENES[case]
    check_said_once(layout, len(triangles), len(balls))
    check_leaf_records(layout, case)
    wide = wide_tree(device, "cwbvh", case)
    assert layout.level_sizes == tuple(len(level) for level in wide.levels())
    assert (layout.stack, layout.depth, layout.nodes) == (stack_bound(wide), wide.depth, len(wide.child))
    if half_area(wide.aabb_min[0].min(axis=0), wide.aabb_max[0].max(axis=0)) > 0:
        assert layout.sah_cost == pytest.approx(wide.sah_cost(MAX_LEAF), rel=1e-5)


@pytest.mark.parametrize("case", COMPRESSED)
def test_compressed_boxes_enclose_closely(device: Device, case: str) -> None:
    """Planes are the nearest outside of the child's own, in steps of the smallest power of two of which 255 reach."""
    layout = built(device, "cwbvh", case)
    nodes, wide = layout.buffers["nodes"], wide_tree(device, "cwbvh", case)
    np.testing.assert_array_equal(nodes["origin"], wide.aabb_min.min(axis=1))
    used = wide.child != EMPTY
    step = np.ldexp(np.float32(1), nodes["exponent"].astype(np.int32) - 127)[:, None]
    low, high = (boxes - nodes["origin"][:, None] for boxes in (wide.aabb_min, wide.aabb_max))
    lo, hi = (nodes[name].transpose(0, 2, 1) * step for name in ("lo", "hi"))
    assert ((lo <= low) & (low < lo + step))[used].all() and ((hi - step < high) & (high <= hi))[used].all()
    extent = np.where(used[..., None], high, 0).max(axis=1, keepdims=True)
    assert ((nodes["exponent"][:, None] == 1) | (255 * step / 2 <= extent)).all()


@pytest.mark.parametrize("case", COMPRESSED)
def test_no_child_and_slot_prefer_each_other(device: Device, case: str) -> None:
    """Holds as for numpy's slots, but to float32 rounding."""
    wide = wide_tree(device, "cwbvh", case)
    corners = np.array([[1 if slot >> axis & 1 else -1 for axis in range(3)] for slot in range(8)])
    for low, high, child in zip(wide.aabb_min.astype(float), wide.aabb_max.astype(float), wide.child):
        used = child != EMPTY
        center = low[used].min(axis=0) + high[used].max(axis=0)
        center_of = np.where(used[:, None], low, 0) + np.where(used[:, None], high, 0)
        worth = np.where(used[:, None], (center_of - center) @ corners.T, -np.inf)
        own = np.diagonal(worth)
        rounding = 1e-6 * np.abs([low[used], high[used]]).max()
        assert (worth[used] <= np.maximum(own[used][:, None], own) + rounding).all()


@pytest.mark.parametrize("layout", SHAPES)
def test_rays_hit_the_same_as_without_a_tree(device: Device, layout: str) -> None:
    corners, rng = soup(2000, 0.1), np.random.default_rng(3)
    mesh = corners.reshape(-1, 3), np.arange(6000).reshape(-1, 3)
    origins, directions = rng.uniform(-0.5, 1.5, (4000, 3)), rng.normal(size=(4000, 3))
    index = device.info.index
    expected = clrt.RayQuery(*mesh, device=index, layout="list").closest_hit(origins, directions)
    query = clrt.RayQuery(*mesh, device=index, layout=layout, builder="ploc")
    np.testing.assert_array_equal(query.closest_hit(origins, directions), expected)
    np.testing.assert_array_equal(query.any_hit(origins, directions), expected["primitive"] >= 0)
