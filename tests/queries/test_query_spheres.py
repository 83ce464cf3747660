"""RayQuery with spheres: t matches the closed form, with the same bits for every layout and traversal."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import clrt
from clrt.accel.traversal_kernels import SPHERE_TESTS
from clrt.device.open import Device

from ..accel.cases import soup, spheres
from ..covering import others
from ..rendering.rays import hit_spheres, hit_triangles

WAYS = [
    ("bvh8", "single"),
    ("bvh8", "packet"),
    ("bvh8", "pool"),
    ("bvh2", None),
    ("cwbvh", None),
    ("packs", None),
    ("list", None),
]
NO_MESH = np.zeros((0, 3)), np.zeros((0, 3), int)
BALLS = np.concatenate([spheres(60, seed=4), [[0.5, 0.5, 0.5, 0.9], [0.2, 0.2, 3.0, 0.05]]]).astype(np.float32)
CORNERS = soup(200, 0.3)
MESH = CORNERS.reshape(-1, 3), np.arange(600).reshape(-1, 3)
RNG = np.random.default_rng(5)
ORIGINS = RNG.uniform(-1, 2, (3000, 3)).astype(np.float32)
DIRECTIONS = (RNG.random((3000, 3)) - ORIGINS).astype(np.float32)
RAYS = ORIGINS.astype(np.float64), DIRECTIONS.astype(np.float64)


@pytest.mark.programs
@pytest.mark.parametrize(
    "mesh, sphere, ways",
    [(MESH, "robust", WAYS), *others((NO_MESH, "robust", WAYS[2:3]), (MESH, "textbook", WAYS[5:]))],
    ids=["among triangles", "alone", "textbook"],
)
def test_hits_are_those_of_the_closed_form(
    device: Device, mesh: Any, sphere: str, ways: list[tuple[str, str | None]]
) -> None:
    """Rays start outside and inside; sphere indices follow the triangles' and t limits apply equally."""
    t, which, margin = hit_spheres(BALLS.astype(np.float64), *RAYS)
    primitive = np.where(np.isfinite(t), which + len(mesh[1]), -1)
    if len(mesh[1]):
        t_triangle, triangle, other_margin = hit_triangles(CORNERS.astype(np.float64), *RAYS)
        primitive = np.where(t_triangle < t, triangle, primitive)
        with np.errstate(invalid="ignore"):
            margin = np.minimum(np.minimum(margin, other_margin), np.abs(np.nan_to_num(t / t_triangle) - 1))
        t = np.minimum(t, t_triangle)
    clear = margin > 1e-3
    hit = clear & np.isfinite(t)
    assert clear.mean() > 0.95 and hit.mean() > 0.5 and np.mean(primitive[hit] >= len(mesh[1])) > 0.4
    limits = (t * np.where(np.arange(len(t)) % 2, 0.999, 1.001)).astype(np.float32)
    answers = []
    for layout, traversal in ways:
        query = clrt.RayQuery(
            *mesh, spheres=BALLS, device=device.info.index, layout=layout, traversal=traversal, sphere=sphere
        )
        found = query.closest_hit(ORIGINS, DIRECTIONS)
        np.testing.assert_array_equal(found["primitive"][clear], primitive[clear])
        np.testing.assert_allclose(found["t"][hit], t[hit], rtol=2e-5, atol=1e-6)
        on_sphere = found["primitive"] >= len(mesh[1])
        assert not found["u"][on_sphere].any() and not found["v"][on_sphere].any()
        answers.append(found)
        if layout == "bvh8":
            np.testing.assert_array_equal(query.any_hit(ORIGINS, DIRECTIONS, limits), found["t"] < limits)
    for found in answers[1:]:
        np.testing.assert_array_equal(found, answers[0])


@pytest.mark.parametrize("layout", ["bvh8", "list"])
def test_all_hits_are_where_rays_enter_and_leave(device: Device, layout: str) -> None:
    """Both roots ahead are returned: for each sphere, each of two coincident ones, and two that touch."""
    balls = [[0, 0, 0, 1], [0, 0, 0, 1], [2, 0, 0, 1], [5, 0, 0, 1]]
    query = clrt.RayQuery(*NO_MESH, spheres=balls, device=device.info.index, layout=layout)
    index, hits = query.all_hits([[-2, 0, 0], [0, 0, 0], [9, 0, 0]], [[1, 0, 0], [1, 0, 0], [-2, 0, 0]])
    found = [list(zip(hits["t"][index == ray].tolist(), hits["primitive"][index == ray].tolist())) for ray in range(3)]
    assert found == [
        [(1, 0), (1, 1), (3, 0), (3, 1), (3, 2), (5, 2), (6, 3), (8, 3)],
        [(1, 0), (1, 1), (1, 2), (3, 2), (4, 3), (6, 3)],
        [(1.5, 3), (2.5, 3), (3, 2), (4, 0), (4, 1), (4, 2), (5, 0), (5, 1)],
    ]


@pytest.mark.parametrize("size", [2.0**-66, 2.0**50])
def test_size_does_not_matter(device: Device, size: float) -> None:
    plain, scaled = (
        clrt.RayQuery(*NO_MESH, spheres=BALLS * np.float32(factor), device=device.info.index).closest_hit(
            ORIGINS * np.float32(factor), DIRECTIONS * np.float32(factor)
        )
        for factor in (1, size)
    )
    np.testing.assert_array_equal(scaled, plain)


def test_robust_spheres_keep_digits_that_the_textbook_loses(device: Device) -> None:
    """Rays toward points of the disc of a unit sphere at distance 3000; `beside` is in radii from its center."""
    beside = np.random.default_rng(1).uniform(-0.6, 0.6, (2000, 2))
    targets = np.column_stack([beside, np.full(2000, 3000.0)]).astype(np.float32)
    balls = np.array([[0, 0, 3000, 1], [0, 0, -9, 1]], np.float32)
    t, _, _ = hit_spheres(balls.astype(np.float64), np.zeros_like(targets, np.float64), targets.astype(np.float64))
    error = {}
    for sphere in SPHERE_TESTS:
        query = clrt.RayQuery(*NO_MESH, spheres=balls, device=device.info.index, sphere=sphere)
        found = query.closest_hit(np.zeros(3), targets)
        error[sphere] = np.abs(np.where(found["primitive"] == 0, found["t"], 0) - t).max()
    assert error["robust"] < 4 * 2.0**-24 < 1e-4 < error["textbook"]  # t is near 1


def test_moved_vertices_leave_spheres_where_they_are(device: Device) -> None:
    moved = (MESH[0] + 0.3).astype(np.float32)
    query, new = (
        clrt.RayQuery(vertices, MESH[1], spheres=BALLS, device=device.info.index) for vertices in (MESH[0], moved)
    )
    before = query.closest_hit(ORIGINS, DIRECTIONS)
    query.refit(moved)
    after = query.closest_hit(ORIGINS, DIRECTIONS)
    np.testing.assert_array_equal(after, new.closest_hit(ORIGINS, DIRECTIONS))
    assert np.any(after != before) and np.any((after == before) & (after["primitive"] >= len(MESH[1])))


@pytest.mark.parametrize(
    "balls, words",
    [
        (np.ones((2, 3)), r"spheres \(2, 3\) must have the shape \(s, 4\)"),
        ([[0, 0, 0, 1], [0, 0, np.nan, 1]], r"spheres\[1\].*finite"),
        ([[0, 0, 0, 0]], r"spheres\[0\].*radius above 0"),
        ([[0, 0, 0, -1]], r"spheres\[0\].*radius above 0"),
        ([[0, 0, 0, np.inf]], r"spheres\[0\].*finite"),
    ],
)
def test_what_is_no_sphere_is_refused(balls: Any, words: str) -> None:
    with pytest.raises(clrt.SceneError, match=words):
        clrt.RayQuery(*NO_MESH, spheres=balls)
