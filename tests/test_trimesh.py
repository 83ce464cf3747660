"""trimesh's meshes with clrt's rays, against trimesh's own engine in float64 and closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

import clrt.trimesh
from clrt.device.open import Device

RNG = np.random.default_rng(3)


def rays(n: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    return RNG.uniform(-1.5, 1.5, (n, 3)), RNG.normal(size=(n, 3))


def test_documented_example(device: Device) -> None:
    """From trimesh's examples: two rays through a sphere, each of which enters and leaves it."""
    mesh = trimesh.primitives.Sphere().to_mesh()
    mesh.ray = clrt.trimesh.RayMeshIntersector(mesh, device=device.info.index)
    origins, directions = np.array([[0, 0, -5], [2, 2, -10]]), np.array([[0, 0, 1], [0, 0, 1]])
    locations, index_ray, index_tri = mesh.ray.intersects_location(ray_origins=origins, ray_directions=directions)
    assert set(index_ray) == {0} and len(index_tri) >= 2
    np.testing.assert_allclose(np.unique(np.round(locations, 5), axis=0), [[0, 0, -1], [0, 0, 1]], atol=1e-4)


def test_same_answers_as_trimesh(device: Device) -> None:
    """On a torus inside a box; away from edges, which its engine takes or leaves as rounding falls."""
    mesh = trimesh.util.concatenate([trimesh.creation.torus(0.7, 0.25), trimesh.creation.box((2.5, 2.5, 2.5))])
    own = clrt.trimesh.RayMeshIntersector(mesh, device=device.info.index)
    theirs: Any = trimesh.ray.ray_triangle.RayMeshIntersector(mesh)
    origins, directions = rays(400)
    ours, expected = own.intersects_location(origins, directions), theirs.intersects_location(origins, directions)
    assert [a.dtype for a in ours] == [a.dtype for a in expected] and ours[0].shape == expected[0].shape
    order, reference = (np.lexsort((triangle, ray)) for _, ray, triangle in (ours, expected))
    for a, b, exact in zip(ours, expected, (False, True, True)):
        np.testing.assert_allclose(a[order], b[reference], atol=0 if exact else 1e-5, rtol=0)
    for method in ("intersects_first", "intersects_any"):
        ours, expected = (getattr(engine, method)(origins, directions) for engine in (own, theirs))
        np.testing.assert_array_equal(ours, expected)
    triangle, ray = own.intersects_id(origins, directions, multiple_hits=False)
    np.testing.assert_array_equal(triangle, own.intersects_first(origins, directions)[ray])


def test_contains_points(device: Device) -> None:
    mesh = trimesh.creation.icosphere(subdivisions=4, radius=1.0)
    points = RNG.uniform(-1.2, 1.2, (5000, 3))
    radius = np.linalg.norm(points, axis=1)
    contains = clrt.trimesh.RayMeshIntersector(mesh, device=device.info.index).contains_points(points)
    np.testing.assert_array_equal(contains[radius > 1], False)
    np.testing.assert_array_equal(contains[radius < 0.99], True)


def test_coincident_surfaces_all_count(device: Device) -> None:
    """A triangle 64 times, and once more a rounding further: every one is hit, once, in order."""
    corners = np.array([[-1, -1, 0], [3, -1, 0], [-1, 3, 0]], np.float32)
    further = corners + np.array([0, 0, np.finfo(np.float32).eps], np.float32)
    mesh = trimesh.Trimesh(np.concatenate([corners, further]), [[0, 1, 2]] * 64 + [[3, 4, 5]], process=False)
    ray = clrt.trimesh.RayMeshIntersector(mesh, device=device.info.index)
    triangle, index_ray = ray.intersects_id([[0, 0, -1]], [[0, 0, 1]])
    np.testing.assert_array_equal(triangle, np.arange(65))
    np.testing.assert_array_equal(index_ray, np.zeros(65))
    triangle, _ = ray.intersects_id([[0, 0, -1]], [[0, 0, 1]], max_hits=10)
    np.testing.assert_array_equal(triangle, np.arange(10))
