"""Triangle and box tests other than the default: correct away from edges, with the known losses at them."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import clrt
from clrt.accel.layouts import pack
from clrt.accel.traversal_kernels import TRIANGLE_TESTS
from clrt.accel.triangle_forms import FORMS, in_form
from clrt.device.open import Device

from ..accel.cases import NO_SPHERES, soup
from ..covering import covering, others
from ..rendering.rays import hit_triangles, icosphere
from .test_instances import MESHES, transforms

VARIANTS = [name for name in TRIANGLE_TESTS if name != "watertight"]
GOOD = np.concatenate([soup(300, 0.3, seed=1), soup(300, 0.05, seed=2)])
RNG = np.random.default_rng(3)


def flat_triangles() -> NDArray[np.float32]:
    """Return triangles without area: points, repeated corners, and collinear corners exact in float32."""
    a, e = RNG.random((60, 3)), RNG.integers(-64, 64, (60, 3)) / 256
    a = np.round(a * 256) / 256
    steps = np.array([[0, 0, 0], [0, 0, 1], [1, 0, 1], [0, 1, 2], [2, 0, 1], [0, 3, 1]])[np.arange(60) % 6]
    return np.asarray(a[:, None] + steps[..., None] * e[:, None], np.float32)


FLAT = flat_triangles()
CORNERS = np.concatenate([GOOD, FLAT])
VERTICES, FACES = CORNERS.reshape(-1, 3), np.arange(3 * len(CORNERS), dtype=np.int32).reshape(-1, 3)


def aimed_rays() -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return rays, half toward random points, half toward points of the triangles without area."""
    origins = RNG.uniform(-1, 2, (3000, 3)).astype(np.float32)
    weights = RNG.dirichlet([1, 1, 1], 1500)
    on_flat = np.einsum("nk,nkj->nj", weights, FLAT[RNG.integers(0, len(FLAT), 1500)].astype(np.float64))
    return origins, (np.concatenate([RNG.random((1500, 3)), on_flat]) - origins).astype(np.float32)


ORIGINS, DIRECTIONS = aimed_rays()


@pytest.mark.programs
@covering("triangle, layout", VARIANTS, ["bvh8", "bvh2", "cwbvh"])
def test_hits_are_those_of_float64_away_from_edges(device: Device, triangle: str, layout: str) -> None:
    """Every layout agrees with float64 away from edges, and bit for bit with brute force.

    Forms that precompute the area never hit triangles without area; from corners alone, rounding may allow a hit.
    """
    faces = FACES if triangle in FORMS else FACES[: len(GOOD)]
    origins, directions = ORIGINS.astype(np.float64), DIRECTIONS.astype(np.float64)
    t, which, margin = hit_triangles(GOOD.astype(np.float64), origins, directions)
    clear = margin > 1e-4
    hit = clear & np.isfinite(t)
    assert clear.mean() > 0.99 and hit.mean() > 0.5
    p0, p1, p2 = GOOD[which[hit]].astype(np.float64).transpose(1, 0, 2)
    there = origins[hit] + t[hit, None] * directions[hit]
    answers = []
    for each in ("list", layout):
        query = clrt.RayQuery(VERTICES, faces, device=device.info.index, layout=each, triangle=triangle)
        answers.append(found := query.closest_hit(ORIGINS, DIRECTIONS))
        assert found["primitive"].max() < len(GOOD)
        np.testing.assert_array_equal(found["primitive"][clear], np.where(np.isfinite(t), which, -1)[clear])
        np.testing.assert_allclose(found["t"][hit], t[hit], rtol=2e-5)
        u, v = found["u"][hit, None], found["v"][hit, None]
        np.testing.assert_allclose(p0 + u * (p1 - p0) + v * (p2 - p0), there, atol=1e-5)
    np.testing.assert_array_equal(answers[0], answers[1])


@pytest.mark.parametrize("triangle", FORMS)
@pytest.mark.parametrize("layout", ["bvh8", "cwbvh"])
def test_records_are_what_the_papers_say(layout: str, triangle: str) -> None:
    """The map takes the corners to (0, 0), (1, 0), (0, 1) in the plane w = 0; edges and normal are rounded once."""
    corners = pack(layout, "sah", GOOD, NO_SPHERES)
    tree = in_form(corners, triangle, None)
    name = "packs" if layout == "bvh8" else "leaf_triangles"
    records, used = tree.buffers[name], tree.buffers[name]["primitive"] >= 0
    assert records.dtype.itemsize == {"packs": 320 + 12 * 8, "leaf_triangles": 64}[name]
    assert tree.bytes - corners.bytes == len(records) * {"packs": 12 * 8, "leaf_triangles": 16}[name]
    rows = {
        field: np.moveaxis(records[field], 1, -1)[used].astype(np.float64)
        for field in records.dtype.names
        if records[field].ndim > 1 and field not in ("primitive", "pad")
    }
    expected = GOOD[records["primitive"][used]].astype(np.float64)
    if triangle == "baldwin_weber":
        points = np.concatenate([expected, np.ones((len(expected), 3, 1))], axis=2)
        mapped = np.stack([np.einsum("nij,nj->ni", points, rows[row]) for row in "uvw"], axis=2)
        # A row's rounding error scales with its length relative to the triangle's size.
        size = sum(np.abs(rows[row]).max(axis=1) for row in "uvw")[:, None, None]
        assert (np.abs(mapped - [[0, 0, 0], [1, 0, 0], [0, 1, 0]]) / size).max() < 3e-7
    else:
        e1, e2 = expected[:, 1] - expected[:, 0], expected[:, 2] - expected[:, 0]
        for field, exact in {"p0": expected[:, 0], "e1": e1, "e2": e2, "n": np.cross(e1, e2)}.items():
            np.testing.assert_array_equal(rows[field], exact.astype(np.float32))


@pytest.mark.programs
@pytest.mark.parametrize("layout, triangle", list(zip(["bvh8", "cwbvh"], FORMS)))
def test_instances_are_hit_by_every_test_alike(device: Device, layout: str, triangle: str) -> None:
    """Away from edges, all tests agree within rounding, also after the instances move."""
    rng = np.random.default_rng(7)
    mesh, to_world = rng.integers(0, 3, 40), transforms(rng, "stretched", 40)
    origins, targets = rng.uniform(-6, 6, (2, 3000, 3)).astype(np.float32)
    one, other = (
        clrt.InstancedRayQuery(MESHES, mesh, to_world, device=device.info.index, layout=layout, **chosen)
        for chosen in ({}, {"triangle": triangle})
    )
    for moved in (to_world, to_world[::-1]):
        for query in (one, other):
            query.move(moved)
        expected, found = (query.closest_hit(origins, targets - origins) for query in (one, other))
        same = (expected["primitive"] == found["primitive"]) & (expected["instance"] == found["instance"])
        assert np.mean(~same) < 1e-3 and np.mean(expected["primitive"] >= 0) > 0.3
        # An origin is known to about 2^-23 of the world's size, which is about the length of the rays.
        np.testing.assert_allclose(found["t"][same], expected["t"][same], rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("triangle", FORMS)
def test_moved_vertices_get_new_records(device: Device, triangle: str) -> None:
    moved = (VERTICES * np.array([1, -1, 1]) + 0.25).astype(np.float32)
    query, new = (
        clrt.RayQuery(vertices, FACES, device=device.info.index, layout="bvh8", triangle=triangle)
        for vertices in (VERTICES, moved)
    )
    query.refit(moved)
    np.testing.assert_array_equal(query.closest_hit(ORIGINS, DIRECTIONS), new.closest_hit(ORIGINS, DIRECTIONS))


@pytest.mark.programs
@pytest.mark.parametrize(
    "layout, traversal", [("bvh8", "single"), ("cwbvh", None), *others(("bvh8", "pool"), ("bvh2", None))]
)
def test_plain_boxes_lose_what_robust_ones_find(device: Device, layout: str, traversal: str | None) -> None:
    """Plain boxes miss some vertices seen from inside a closed mesh, where boxes end; face centers give equal hits.

    The mesh is ten radii from the origin, so that the BVH's box padding is rounded away; a sphere opposite it keeps
    the scene from being recentered.
    """
    ball, faces = icosphere(4)
    vertices = np.asarray(ball + 10, np.float32)
    targets = np.repeat(vertices, 20, axis=0)
    origins = np.random.default_rng(0).uniform(9.5, 10.5, targets.shape).astype(np.float32)
    given: dict[str, Any] = {"spheres": [[-10, -10, -10, 0.1]], "device": device.info.index}
    robust = clrt.RayQuery(vertices, faces, layout="bvh8", **given)
    plain = clrt.RayQuery(vertices, faces, layout=layout, traversal=traversal, box="plain", **given)
    assert np.all(robust.closest_hit(origins, targets - origins)["primitive"] >= 0)
    assert 0 < np.sum(plain.closest_hit(origins, targets - origins)["primitive"] < 0) < 0.1 * len(targets)
    middles = vertices[faces].mean(axis=1, dtype=np.float32)
    rays = origins[: len(middles)], middles - origins[: len(middles)]
    np.testing.assert_array_equal(plain.closest_hit(*rays), robust.closest_hit(*rays))


@pytest.mark.parametrize(
    "kind, choices",
    {
        "triangle": "watertight, moller_trumbore, precomputed, baldwin_weber",
        "box": "robust, plain",
        "sphere": "robust, textbook",
    }.items(),
)
def test_unknown_tests_are_refused(kind: str, choices: str) -> None:
    scene = clrt.Scene(spheres=[clrt.Sphere()])
    asks: list[Any] = [
        lambda **chosen: clrt.RayQuery(VERTICES, FACES, **chosen),
        lambda **chosen: clrt.Renderer(scene, **chosen),
    ]
    for ask, wrong in product(asks, ("", "fast")):
        with pytest.raises(clrt.UsageError, match=f"{kind} '{wrong}' is unknown; choose from {choices}"):
            ask(**{kind: wrong})
