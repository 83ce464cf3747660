"""After RayQuery.refit and InstancedRayQuery.move, the old BVH gives the hits of a new query."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import clrt
from clrt.accel.wide import EMPTY
from clrt.device.open import Device

from ..accel.cases import edges
from ..covering import others
from ..rendering.rays import icosphere
from .test_instances import LAYOUTS, MESHES, transforms

Floats = NDArray[np.float32]
Records = dict[str, NDArray[Any]]
BALL, BALL_FACES = icosphere(3)
#: Five spheres, which occlude each other, plus duplicate and degenerate faces.
FACES = np.concatenate([BALL_FACES + i * len(BALL) for i in range(5)] + [BALL_FACES[:50], [[0, 0, 1], [2, 2, 2]]])
VERTICES = np.concatenate([BALL + np.array([1.2 * i, 0, 0], np.float32) for i in range(5)])
RNG = np.random.default_rng(17)
SHUFFLED = RNG.permutation(VERTICES)
ORIGINS = RNG.uniform(-3, 8, (3000, 3)).astype(np.float32)
DIRECTIONS = (VERTICES[RNG.integers(0, len(VERTICES), 3000)] - ORIGINS + RNG.normal(0, 0.3, (3000, 3))).astype(
    np.float32
)
CORNERS = ("p0", "p1", "p2")
TREES = [("bvh8", "ploc"), ("bvh8", "sah"), ("bvh2", "ploc"), ("bvh2", "sah"), ("bvh2", "midpoint")]


def query(device: Device, vertices: Floats, tree: tuple[str, str]) -> clrt.RayQuery:
    return clrt.RayQuery(vertices, FACES, device=device.info.index, layout=tree[0], builder=tree[1])


def wave(phase: float) -> Floats:
    """Return the vertices after a small smooth motion."""
    return (VERTICES + 0.1 * np.sin(2 * VERTICES[:, [1, 2, 0]] + phase)).astype(np.float32)


def assert_same_answers(one: clrt.RayQuery, other: clrt.RayQuery, size: float = 1.0) -> None:
    """Compare hits bit for bit, for rays scaled by `size`."""
    rays = ORIGINS * np.float32(size), DIRECTIONS * np.float32(size)
    hits = one.closest_hit(*rays)
    assert (hits["primitive"] >= 0).mean() > 0.4
    np.testing.assert_array_equal(hits, other.closest_hit(*rays))
    np.testing.assert_array_equal(one.any_hit(*rays, 0.5), other.any_hit(*rays, 0.5))


def read(refitted: clrt.RayQuery) -> Records:
    return {name: array.read(refitted.device) for name, array in refitted.tree.buffers.items()}


@pytest.mark.parametrize(
    "tree",
    [TREES[0], TREES[3], ("cwbvh", "sah"), ("list", "sah"), *others(*((tree,) for tree in TREES[1:3] + TREES[4:]))],
    ids="-".join,
)
def test_hits_after_a_refit_are_those_of_a_new_query(device: Device, tree: tuple[str, str]) -> None:
    """Holds after a small motion, another one, and a permutation of all vertices."""
    refitted = query(device, VERTICES, tree)
    for moved in (wave(0.0), wave(2.0), SHUFFLED):
        refitted.refit(moved)
        assert_same_answers(refitted, query(device, moved, tree))


@pytest.mark.parametrize("tree", TREES, ids="-".join)
def test_where_nothing_moves_no_bit_changes(device: Device, tree: tuple[str, str]) -> None:
    refitted = query(device, VERTICES, tree)
    before = read(refitted)
    refitted.refit(wave(1.0))
    assert (read(refitted)["nodes"] != before["nodes"]).any()
    refitted.refit(VERTICES)
    for name, records in read(refitted).items():
        assert records.tobytes() == before[name].tobytes()


def box(triangles: Floats) -> Floats:
    """Return the (2, 3) bounds of triangles (k, 3, 3)."""
    low, high = edges(triangles)
    return np.stack([low.min(axis=0), high.max(axis=0)])


@pytest.mark.parametrize("builder", ["ploc", "sah"])
def test_wide_boxes_are_those_of_what_is_below(device: Device, builder: str) -> None:
    refitted = query(device, VERTICES, ("bvh8", builder))
    refitted.refit(SHUFFLED)
    nodes, packs = read(refitted)["nodes"], read(refitted)["packs"]
    bounds = np.stack([nodes["lo"].min(axis=2), nodes["hi"].max(axis=2)], axis=1)
    found = np.stack([nodes["lo"], nodes["hi"]], axis=1)
    for row, slot in zip(*np.nonzero(nodes["child"] != EMPTY)):
        child = int(nodes["child"][row, slot])
        if child >= 0:
            np.testing.assert_array_equal(found[row, :, :, slot], bounds[child])
            continue
        pack = packs[~child >> 4]
        used = pack["primitive"] >= 0
        corners = SHUFFLED[FACES[pack["primitive"][used]]]
        np.testing.assert_array_equal(np.stack([pack[name].T[used] for name in CORNERS], axis=1), corners)
        np.testing.assert_array_equal(found[row, :, :, slot], box(corners))


@pytest.mark.parametrize("builder", ["ploc", "sah"])
def test_binary_boxes_are_those_of_what_is_below(device: Device, builder: str) -> None:
    refitted = query(device, VERTICES, ("bvh2", builder))
    refitted.refit(SHUFFLED)
    nodes, leaves = read(refitted)["nodes"], read(refitted)["leaf_triangles"]
    corners = np.stack([leaves[name] for name in CORNERS], axis=1)
    np.testing.assert_array_equal(corners, SHUFFLED[FACES[leaves["primitive"]]])
    found = np.stack([nodes["aabb_min"], nodes["aabb_max"]], axis=1)
    for row in np.delete(np.arange(len(nodes)), 1):
        first, count = int(nodes["left_first"][row]), int(nodes["count"][row])
        below = found[first : first + 2]
        union = np.stack([below[:, 0].min(axis=0), below[:, 1].max(axis=0)])
        np.testing.assert_array_equal(found[row], box(corners[first : first + count]) if count else union)


@pytest.mark.parametrize("layout", ["bvh8", "bvh2"])
def test_any_size_after_any_other(device: Device, layout: str) -> None:
    """Works by a refit, or by a rebuild if a refit would exceed float32's range."""
    refitted = query(device, VERTICES, (layout, "sah"))
    plain = query(device, VERTICES, (layout, "sah"))
    expected = plain.closest_hit(ORIGINS, DIRECTIONS)
    for exponent in (10, 60, -70, -69, 0):
        size = 2.0**exponent
        refitted.refit(VERTICES * np.float32(size))
        hits = refitted.closest_hit(ORIGINS * np.float32(size), DIRECTIONS * np.float32(size))
        np.testing.assert_array_equal(hits, expected)


def test_vertices_that_no_face_uses_may_be_anywhere(device: Device) -> None:
    vertices = np.concatenate([VERTICES, np.zeros((1, 3), np.float32)])
    refitted = query(device, vertices, ("bvh8", "sah"))
    tree = refitted.tree
    moved = np.concatenate([wave(0.0), np.array([[0, -3e38, 0]], np.float32)])
    refitted.refit(moved)
    assert refitted.tree is tree
    assert_same_answers(refitted, query(device, moved, ("bvh8", "sah")))


@pytest.mark.parametrize("layout", ["bvh8", "bvh2"])
def test_tiny_meshes(device: Device, layout: str) -> None:
    """Meshes with no triangle and with one."""
    for faces, hit in (np.zeros((0, 3), int), -1), ([[0, 1, 2]], 0):
        small = clrt.RayQuery(np.zeros((3, 3)), faces, device=device.info.index, layout=layout)
        small.refit([[-1, -1, 0], [1, -1, 0], [0, 1, 0]])
        assert small.closest_hit([0, 0, 1], [0, 0, -1])["primitive"].tolist() == [hit]


@pytest.mark.parametrize(
    "vertices, message",
    [
        (VERTICES[:-1], rf"vertices \({len(VERTICES) - 1}, 3\): the mesh has {len(VERTICES)}"),
        (VERTICES[:, :2], r"must have the shape \(n, 3\)"),
        (np.where(np.arange(len(VERTICES))[:, None] == 7, np.nan, VERTICES), r"vertices\[7\].*not finite"),
    ],
)
def test_other_meshes_are_refused(device: Device, vertices: Any, message: str) -> None:
    refitted = query(device, VERTICES, ("bvh8", "sah"))
    with pytest.raises(clrt.SceneError, match=message):
        refitted.refit(vertices)
    assert_same_answers(refitted, query(device, VERTICES, ("bvh8", "sah")))


@pytest.mark.parametrize("layout", LAYOUTS)
def test_moved_instances_are_where_they_are_put(device: Device, layout: str) -> None:
    """Moves keep the buffers: near, far apart (another upper level), all in one place, and at another world size."""
    rng = np.random.default_rng(23)
    mesh = rng.integers(0, 3, 50)
    origins, targets = rng.uniform(-4, 4, (2, 1500, 3)).astype(np.float32)

    def placed(to_world: NDArray[np.float64]) -> clrt.InstancedRayQuery:
        return clrt.InstancedRayQuery(MESHES, mesh, to_world, device=device.info.index, layout=layout)

    start = transforms(rng, "turned", 50)
    moved = placed(start)
    buffers = moved.tree.buffers
    in_one_place = start * [1, 1, 1, 0]
    for to_world in (transforms(rng, "mirrored", 50), in_one_place, 1e-20 * start, transforms(rng, "stretched", 50)):
        size = np.float32(1 if np.abs(to_world).max() > 1e-3 else 1e-20)
        moved.move(to_world)
        rays = size * origins, size * (targets - origins)
        hits = moved.closest_hit(*rays)
        assert (hits["primitive"] >= 0).mean() > 0.1
        np.testing.assert_array_equal(hits, placed(to_world).closest_hit(*rays))
        assert all(moved.tree.buffers[name] is array for name, array in buffers.items())


def test_other_instances_are_refused(device: Device) -> None:
    moved = clrt.InstancedRayQuery(MESHES, [0, 1], np.tile(np.eye(3, 4), (2, 1, 1)), device=device.info.index)
    with pytest.raises(clrt.SceneError, match=r"transforms \(3, 3, 4\) must have the shape \(2, 3, 4\)"):
        moved.move(np.tile(np.eye(3, 4), (3, 1, 1)))
    with pytest.raises(clrt.SceneError, match=r"transforms\[1\].*flattens"):
        moved.move([np.eye(3, 4), np.zeros((3, 4))])
