"""Bounds on closest hits agree with Möller–Trumbore in float64 and detect wrong answers."""

from __future__ import annotations

import numpy as np
import pytest

import clrt
from clrt.bench.numerics.aimed_rays import all_rays, rays_of_kinds
from clrt.bench.numerics.exact_hits import UNDECIDED, closest_bounds
from clrt.bench.rays.hard_meshes import icosphere, soup
from clrt.bench.rays.ray_speed import Rays
from clrt.bench.rays.workloads import Mesh
from clrt.device.open import Device

from ..rendering.rays import hit_triangles

RNG = np.random.default_rng(9)
MESHES = {"icosphere": icosphere(2), "soup": soup(300)}


def rays_at(mesh: Mesh, count: int = 400) -> Rays:
    return all_rays(rays_of_kinds(*mesh, count))


@pytest.mark.parametrize("name", MESHES)
def test_bounds_hold_the_exact_hits(name: str) -> None:
    """A decided triangle is the exact one, the lowest of copies; elsewhere t is within the bounds."""
    vertices, faces = MESHES[name]
    rays = rays_at((vertices, faces))
    bounds = closest_bounds(vertices, faces, rays)
    directions = rays[1].astype(np.float64)
    lengths = np.linalg.norm(directions, axis=1)
    corners = vertices[faces].astype(np.float64)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    with_area = np.flatnonzero(np.linalg.norm(normals, axis=1) > 1e-12)
    with np.errstate(invalid="ignore"):
        t, first, _ = hit_triangles(corners[with_area], rays[0].astype(np.float64), directions / lengths[:, None])
    primitive = np.where(np.isinf(t), -1, with_area[first])
    named = bounds.primitive != UNDECIDED
    np.testing.assert_array_equal(bounds.primitive[named], primitive[named])
    certain = named | np.isfinite(bounds.high)
    assert (bounds.low <= t).all() and (t[certain] <= bounds.high[certain]).all()
    assert named.reshape(4, -1).mean(axis=1)[0] > 0.99, "random rays"
    narrow = named & (primitive >= 0)
    assert np.median(bounds.high[narrow] - bounds.low[narrow]) < 2e-5 * np.ptp(vertices)


def test_answers_are_not_wrong_until_they_are_changed(device: Device) -> None:
    mesh = MESHES["icosphere"]
    rays = rays_at(mesh)
    bounds = closest_bounds(*mesh, rays)
    hits = clrt.RayQuery(*mesh, device=device.info.index).closest_hit(*rays)
    assert not bounds.wrong(rays, hits).any()
    hit = (hits["primitive"] >= 0) & (bounds.primitive != UNDECIDED)
    assert hit.sum() > 200
    farther, other, lost = hits.copy(), hits.copy(), hits.copy()
    farther["t"] += 0.01
    other["primitive"] ^= 1
    lost["t"], lost["primitive"] = np.inf, -1
    invented = lost.copy()
    invented["t"], invented["primitive"] = 1.0, 3
    for changed in (other, lost):
        np.testing.assert_array_equal(bounds.wrong(rays, changed)[hit], True)
    steep = hit & (bounds.high < bounds.low + 2e-4)
    assert steep.sum() > 200 and bounds.wrong(rays, farther)[steep].all()
    missed = bounds.primitive == -1
    assert missed.sum() > 100 and bounds.wrong(rays, invented)[missed].all()


def test_rays_along_planes_are_left_open_and_flat_triangles_never_met() -> None:
    """Degenerate triangles have collinear corners, or two in one place."""
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0]], np.float32)
    origin, direction = np.array([[0.5, 0.0, 1.0]]), np.array([[0.0, 0, -1]])
    down = (origin.astype(np.float32), direction.astype(np.float32), np.array([np.inf], np.float32))
    along = (np.array([[-1, 0.25, 0]], np.float32), np.array([[1, 0, 0]], np.float32), down[2])
    for face, rays, primitive in (([0, 1, 3], down, -1), ([0, 1, 1], down, -1), ([0, 1, 2], along, UNDECIDED)):
        bounds = closest_bounds(vertices, np.array([face], np.int32), rays)
        assert bounds.primitive.tolist() == [primitive] and np.isinf(bounds.high).all()
        assert np.isinf(bounds.low[0]) == (primitive == -1)
