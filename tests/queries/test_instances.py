"""InstancedRayQuery returns the hits of the same triangles transformed to the world, for all kinds of transforms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import clrt
from clrt.device.open import Device

from ..covering import covering, others

Doubles = NDArray[np.float64]
RNG = np.random.default_rng(11)
MESHES = [
    (RNG.uniform(-1, 1, (3 * n, 3)).astype(np.float32), np.arange(3 * n, dtype=np.int32).reshape(-1, 3))
    for n in (60, 1, 9)
]
RAYS = 1500
LAYOUTS = ["bvh8", "bvh2", "cwbvh"]
WAYS = (("bvh8", "single"), ("bvh8", "pool"), ("bvh2", None), ("cwbvh", None))
#: Name of the leaf buffer by layout.
LEAVES = {"bvh8": "packs", "bvh2": "leaf_triangles", "cwbvh": "leaf_triangles"}


def transforms(rng: np.random.Generator, kind: str, count: int) -> Doubles:
    """Return (count, 3, 4) transforms: rotated, scaled, mirrored or nearly flattened."""
    turned = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0]
    scale = {
        "turned": np.ones((count, 1, 3)),
        "stretched": rng.uniform(0.1, 3, (count, 1, 3)),
        "mirrored": rng.choice([-1.0, 1.0], (count, 1, 3)),
        "flat": np.tile([1.0, 1.0, 1e-5], (count, 1, 1)),
        "tiny": np.full((count, 1, 3), 1e-4),
    }[kind]
    return np.concatenate([turned * scale, rng.uniform(-4, 4, (count, 3, 1))], axis=2)


def baked(mesh: NDArray[Any], to_world: Doubles) -> tuple[Doubles, NDArray[np.intp]]:
    """Return (m, 3, 3) corners in the world, and the (m, 2) instance and primitive of each."""
    corners = [
        MESHES[index][0].astype(np.float64) @ matrix[:, :3].T + matrix[:, 3] for index, matrix in zip(mesh, to_world)
    ]
    names = [(i, primitive) for i, index in enumerate(mesh) for primitive in range(len(MESHES[index][1]))]
    return np.concatenate(corners).reshape(-1, 3, 3), np.array(names)


def aimed(rng: np.random.Generator, corners: Doubles) -> tuple[Doubles, Doubles]:
    """Return rays through points well inside triangles of the world, from all directions."""
    weights = rng.dirichlet([4, 4, 4], RAYS)
    targets = np.einsum("nk,nkj->nj", weights, corners[rng.integers(0, len(corners), RAYS)])
    origins = rng.normal(size=(RAYS, 3)) * 6
    return origins, targets - origins


def brute_force(corners: Doubles, origins: Doubles, directions: Doubles) -> tuple[Doubles, Doubles]:
    """Return (n, m) float64: t of each ray at each triangle, inf outside, and the smallest barycentric of the hit."""
    p0, e1, e2 = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(e1, e2)
    with np.errstate(divide="ignore", invalid="ignore"):
        det = -(directions @ normal.T)
        s = origins[:, None] - p0
        t = np.einsum("nmj,mj->nm", s, normal) / det
        m = np.cross(s, directions[:, None])
        u, v = np.einsum("nmj,mj->nm", m, e2) / det, -np.einsum("nmj,mj->nm", m, e1) / det
    depth = np.where(t > 0, np.minimum(np.minimum(u, v), 1 - u - v), -np.inf)
    return np.where(depth >= 0, t, np.inf), depth


@covering("kind, way", ["turned", "stretched", "mirrored", "flat", "tiny"], WAYS)
def test_instances_are_hit_like_baked_triangles(device: Device, kind: str, way: tuple[str, str | None]) -> None:
    layout, traversal = way
    rng = np.random.default_rng(3)
    mesh = rng.integers(0, 3, 12)
    to_world = transforms(rng, kind, 12)
    corners, names = baked(mesh, to_world)
    origins, directions = aimed(rng, corners)
    origins, directions = origins.astype(np.float32), directions.astype(np.float32)
    t, depth = brute_force(corners, origins.astype(np.float64), directions.astype(np.float64))
    nearest, first = t.min(axis=1), t.argmin(axis=1)
    second = np.partition(t, 1, axis=1)[:, 1]
    normal = np.cross(corners[first, 1] - corners[first, 0], corners[first, 2] - corners[first, 0])
    grazing = np.abs((normal * directions).sum(1)) < 0.05 * np.linalg.norm(normal, axis=1) * np.linalg.norm(
        directions, axis=1
    )
    # Relative to a tiny, distant mesh, rays are only accurate to a hundredth of its size.
    clear = (np.abs(depth) > (0.03 if kind == "tiny" else 1e-3)).all(axis=1) & (second > 1.001 * nearest) & ~grazing
    assert clear.sum() > 50
    query = clrt.InstancedRayQuery(MESHES, mesh, to_world, device=device.info.index, layout=layout, traversal=traversal)
    hits = query.closest_hit(origins, directions)
    hit = np.isfinite(nearest)
    expected = np.where(hit[:, None], names[first], -1)
    np.testing.assert_array_equal(np.stack([hits["instance"], hits["primitive"]], axis=1)[clear], expected[clear])
    np.testing.assert_allclose(hits["t"][clear], nearest[clear], rtol=2e-3 if kind == "flat" else 1e-4, atol=1e-6)
    np.testing.assert_array_equal(query.any_hit(origins, directions)[clear], hit[clear])


@pytest.mark.programs
@pytest.mark.parametrize("lanes, ways", [(1, WAYS[::3]), (8, WAYS)])
def test_layouts_agree_to_the_last_bit(
    device: Device, lanes: int, ways: tuple[tuple[str, str | None], ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Includes many overlapping instances, so that a ray returns to the upper level many times."""
    monkeypatch.setattr(Device, "lanes", lanes)
    rng = np.random.default_rng(7)
    mesh = rng.integers(0, 3, 300)
    to_world = np.concatenate([transforms(rng, kind, 100) for kind in ("turned", "stretched", "mirrored")])
    origins, targets = rng.uniform(-8, 8, (2, 4000, 3)).astype(np.float32)
    answers = []
    for layout, traversal in ways:
        query = clrt.InstancedRayQuery(
            MESHES, mesh, to_world, device=device.info.index, layout=layout, traversal=traversal
        )
        answers.append(
            (
                query.closest_hit(origins, targets - origins),
                query.any_hit(origins, targets - origins, 0.7),
                *query.all_hits(origins[:200], (targets - origins)[:200]),
            )
        )
    assert (answers[0][0]["primitive"] >= 0).mean() > 0.5 and 0.3 < answers[0][1].mean() < 0.9
    for alike in answers[1:]:
        for answer, other in zip(answers[0], alike):
            np.testing.assert_array_equal(answer, other)


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("mesh_size, world_size", [(1e-20, 1.0), (1e15, 1.0), (1.0, 1e-20), (1e15, 1e15)])
def test_sizes_do_not_matter(device: Device, layout: str, mesh_size: float, world_size: float) -> None:
    """Scaling the meshes or the world by powers of two changes no bit of the hits."""
    mesh_size, world_size = (2.0 ** round(np.log2(size)) for size in (mesh_size, world_size))
    rng = np.random.default_rng(5)
    mesh, to_world = rng.integers(0, 3, 20), transforms(rng, "stretched", 20)
    origins, targets = rng.uniform(-8, 8, (2, 1000, 3)).astype(np.float32)
    plain = clrt.InstancedRayQuery(MESHES, mesh, to_world, device=device.info.index, layout=layout)
    scaled = clrt.InstancedRayQuery(
        [(vertices * np.float32(mesh_size), faces) for vertices, faces in MESHES],
        mesh,
        world_size * to_world * [*[1 / mesh_size] * 3, 1],
        device=device.info.index,
        layout=layout,
    )
    hits = plain.closest_hit(origins, targets - origins)
    assert (hits["primitive"] >= 0).mean() > 0.2
    origins, targets = origins * np.float32(world_size), targets * np.float32(world_size)
    np.testing.assert_array_equal(scaled.closest_hit(origins, targets - origins), hits)


@pytest.mark.parametrize("layout", [LAYOUTS[0], *others(*LAYOUTS[1:])])
def test_all_hits_of_instances_that_coincide(device: Device, layout: str) -> None:
    """At equal t, hits are ordered by instance, then primitive, and each occurs once."""
    triangle = (np.array([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], np.float32), np.array([[0, 1, 2], [0, 1, 2]], np.int32))
    same = np.tile(np.eye(3, 4), (3, 1, 1))
    query = clrt.InstancedRayQuery([triangle], [0, 0, 0], same, device=device.info.index, layout=layout)
    ray, hits = query.all_hits([0, 0, 2], [0, 0, -1])
    assert hits["instance"].tolist() == [0, 0, 1, 1, 2, 2] and hits["primitive"].tolist() == [0, 1] * 3
    assert query.closest_hit([0, 0, 2], [0, 0, -1])["instance"].tolist() == [0]


@pytest.mark.parametrize("layout", LAYOUTS)
def test_ten_thousand_instances_cost_the_memory_of_one(device: Device, layout: str) -> None:
    """On a grid, the ray into each cell hits its own instance; the lower-level BVH is stored once."""
    side = 100
    cells = np.stack(np.meshgrid(np.arange(side), np.arange(side)), axis=-1).reshape(-1, 2)
    to_world = np.tile(np.eye(3, 4), (side * side, 1, 1))
    to_world[:, :2, 3] = 3 * cells
    blanket = (
        np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32),
        np.array([[0, 1, 2], [0, 2, 3]], np.int32),
    )
    query = clrt.InstancedRayQuery(
        [blanket], np.zeros(side * side, int), to_world, device=device.info.index, layout=layout
    )
    origins = np.concatenate([3 * cells + [0.3, 0.2], np.ones((side * side, 1))], axis=1)
    hits = query.closest_hit(origins, [0, 0, -1])
    np.testing.assert_array_equal(hits["instance"], np.arange(side * side))
    np.testing.assert_allclose(hits["t"], 1, rtol=1e-6)
    assert len(query.tree.buffers[LEAVES[layout]]) == (1 if layout == "bvh8" else 2)
    assert not query.any_hit(origins + [1.5, 1.5, 0], [0, 0, -1]).any()


@pytest.mark.parametrize("layout", LAYOUTS)
def test_nothing_to_hit(device: Device, layout: str) -> None:
    empty = (np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32))
    for mesh, meshes in (([], MESHES), ([], []), ([0, 0], [empty]), ([0, 0], [empty, *MESHES])):
        query = clrt.InstancedRayQuery(
            meshes,
            np.array(mesh, int),
            np.tile(np.eye(3, 4), (len(mesh), 1, 1)),
            device=device.info.index,
            layout=layout,
        )
        hits = query.closest_hit([0, 0, 0], [[0, 0, 1], [1, 1, 1]])
        assert hits["instance"].tolist() == hits["primitive"].tolist() == [-1, -1]


@pytest.mark.parametrize(
    "mesh, matrix, message",
    [
        ([3], np.eye(3, 4), r"mesh\[0\] = 3: there are 3 meshes"),
        ([0], np.eye(4), r"transforms \(1, 4, 4\) must .*transforms\[:, :3\]"),
        ([0], 1j * np.eye(3, 4), "transforms has dtype complex128"),
        ([0], np.diag([1.0, 1.0, 0.0]) @ np.eye(3, 4), r"transforms\[0\].*flattens the mesh"),
        ([0], np.full((3, 4), np.nan), r"transforms\[0\].*not finite"),
        ([0.5], np.eye(3, 4), "integers"),
    ],
)
def test_mistakes_are_named(device: Device, mesh: list[Any], matrix: Doubles, message: str) -> None:
    with pytest.raises(clrt.SceneError, match=message):
        clrt.InstancedRayQuery(MESHES, mesh, matrix[None], device=device.info.index)


def test_every_fault_of_transforms_is_named(device: Device) -> None:
    faulty = np.tile(np.eye(3, 4), (6, 1, 1))
    faulty[[1, 3]], faulty[[2, 4, 5], 0, 0] = [[[np.nan]], [[np.inf]]], 0
    with pytest.raises(clrt.SceneError) as caught:
        clrt.InstancedRayQuery(MESHES, [0] * 6, faulty, device=device.info.index)
    first, second = caught.value.problems
    assert first.startswith("transforms[1]") and "not finite" in first and "1 more" in first
    assert second.startswith("transforms[2]") and "flattens" in second and "2 more" in second


@pytest.mark.parametrize(
    "meshes, message",
    [
        (MESHES[0], r"meshes\[0\] is not a pair \(vertices, faces\); write"),
        (None, "meshes is a NoneType"),
        ([MESHES[0], (np.zeros((3, 3)), [[0, 1, 3]])], r"^meshes\[1\]: faces\[0\]"),
    ],
)
def test_what_are_no_meshes_is_refused(device: Device, meshes: Any, message: str) -> None:
    with pytest.raises(clrt.SceneError, match=message):
        clrt.InstancedRayQuery(meshes, [0], np.eye(3, 4)[None], device=device.info.index)


def test_hits_hold_what_is_documented(device: Device) -> None:
    query = clrt.InstancedRayQuery(MESHES, [0], np.eye(3, 4)[None], device=device.info.index)
    for hits in (query.closest_hit([0, 0, 2], [0, 0, -1]), query.all_hits([0, 0, 2], [0, 0, -1])[1]):
        assert hits.dtype.names == ("t", "primitive", "u", "v", "instance")


def test_a_layout_without_an_upper_level_is_refused(device: Device) -> None:
    with pytest.raises(clrt.UsageError, match="list.*bvh2, bvh8, cwbvh"):
        clrt.InstancedRayQuery(MESHES, [0], [np.eye(3, 4)], device=device.info.index, layout="list")
