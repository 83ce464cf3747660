"""Scenes and rays of the studies: closed meshes, areas and shapes; origins, directions and ends of rays."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from numpy.typing import NDArray

import clrt
from clrt.bench.rays.ray_speed import Floats
from clrt.bench.rays.workloads import (
    GAP,
    Faces,
    Mesh,
    bounce_rays,
    bumpy_ball,
    camera_rays,
    closed_room,
    light_rays,
    rotated_copies,
    subdivide,
    surface_points,
    workloads,
)
from clrt.bench.significance import chi2_test, sidak
from clrt.device.open import Device

from ..rendering.rays import icosphere

Doubles = NDArray[np.float64]
RNG = np.random.default_rng(11)
#: A tetrahedron with a right-angled corner at the origin, volume 1/6 · 1·2·3, and all edges of different length.
TETRAHEDRON = (
    np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3]], np.float32),
    np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], np.int32),
)


def corners(vertices: Floats, faces: Faces) -> Doubles:
    return vertices[faces].astype(np.float64)


def area(vertices: Floats, faces: Faces) -> float:
    p0, p1, p2 = corners(vertices, faces).transpose(1, 0, 2)
    return float(np.linalg.norm(np.cross(p1 - p0, p2 - p0), axis=1).sum() / 2)


def volume(vertices: Floats, faces: Faces) -> float:
    """Return the volume by the divergence theorem, for a closed mesh with outward-facing triangles."""
    return float(np.linalg.det(corners(vertices, faces)).sum() / 6)


def assert_closed(faces: Faces) -> None:
    """Assert that every edge occurs once in each direction."""
    edges = Counter(map(tuple, faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2).tolist()))
    assert set(edges.values()) == {1} and all((b, a) in edges for a, b in edges)


def on_the_sphere(count: int) -> Doubles:
    vectors = RNG.normal(size=(count, 3))
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


def test_room_is_a_closed_cube(device: Device) -> None:
    vertices, faces = closed_room(*TETRAHEDRON)
    assert_closed(faces)
    np.testing.assert_array_equal(faces[:4], TETRAHEDRON[1])
    assert len(faces) == 4 + 12
    assert volume(vertices, faces[4:]) == pytest.approx(9**3), "half the edge is 1.5 times the largest extent, 3"
    np.testing.assert_allclose(vertices[4:].mean(axis=0), [0.5, 1, 1.5])
    origins = RNG.uniform([-4, -3, -3], [5, 5, 6], (5000, 3))
    hits = clrt.RayQuery(vertices, faces, device=device.info.index).closest_hit(origins, RNG.normal(size=(5000, 3)))
    assert (hits["primitive"] >= 0).all()


@pytest.mark.parametrize("mesh", [TETRAHEDRON, bumpy_ball(3)], ids=["tetrahedron", "ball"])
def test_subdivision_keeps_the_surface(mesh: Mesh) -> None:
    fine = subdivide(*mesh)
    assert len(fine[1]) == 4 * len(mesh[1])
    assert len(fine[0]) == len(mesh[0]) + 3 * len(mesh[1]) // 2, "a vertex more for each edge"
    assert_closed(fine[1])
    assert area(*fine) == pytest.approx(area(*mesh), rel=1e-6)
    assert volume(*fine) == pytest.approx(volume(*mesh), rel=1e-6)


def test_bumpy_ball_is_closed_and_about_one_in_radius() -> None:
    vertices, faces = bumpy_ball(5)
    assert_closed(faces)
    assert len(faces) == 12 * 4**5
    radii = np.linalg.norm(vertices, axis=1)
    assert 0.88 < radii.min() < 0.95 and 1.05 < radii.max() < 1.12
    assert volume(vertices, faces) == pytest.approx(4 / 3 * np.pi, rel=0.02)


def test_copies_are_turned_not_bent() -> None:
    vertices, faces = rotated_copies(*TETRAHEDRON, 20)
    copies = vertices[faces].reshape(20, 4, 3, 3).astype(np.float64)
    np.testing.assert_allclose(np.linalg.det(copies - copies[:, :1, :1].repeat(4, 1)).sum(axis=1) / 6, 1, rtol=1e-4)
    edges = np.linalg.norm(copies - np.roll(copies, 1, axis=2), axis=-1)
    np.testing.assert_allclose(edges, edges[:1].repeat(20, 0), rtol=1e-4)
    middles = copies.reshape(20, -1, 3).mean(axis=1)
    apart = np.linalg.norm(middles[:, None] - middles, axis=-1) + 9 * np.eye(20)
    assert apart.min() > 1
    axes = copies[:, 0, 1] - copies[:, 0, 0]
    assert len(np.unique(np.round(axes, 3), axis=0)) == 20
    np.testing.assert_array_equal(vertices, rotated_copies(*TETRAHEDRON, 20)[0])


def test_camera_rays_go_through_the_pixels_row_by_row() -> None:
    """Looking at the origin from +z: y decreases from row to row, and the vertical field of view is 45 degrees."""
    origins, directions, t_max = camera_rays(np.array([0.0, 0.0, 4.0]), np.zeros(3), (60, 40))
    assert np.isinf(t_max).all() and (origins == [0, 0, 4]).all()
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1, atol=1e-6)
    slopes = (directions[:, :2] / -directions[:, 2:]).reshape(40, 60, 2)
    top = np.tan(np.radians(22.5)) * 39 / 40
    np.testing.assert_allclose(slopes[0, :, 1], top, rtol=1e-5)
    np.testing.assert_allclose(slopes[-1, :, 1], -top, rtol=1e-5)
    np.testing.assert_allclose(slopes[:, 0, 0], -np.tan(np.radians(22.5)) * 59 / 40, rtol=1e-5)
    np.testing.assert_allclose(np.diff(slopes[..., 0], axis=1), 2 * np.tan(np.radians(22.5)) / 40, rtol=1e-3)


def test_surface_points_are_where_rays_hit_planes(device: Device) -> None:
    """Points agree with ray–plane intersections in float64; normals face the ray origins; misses are excluded."""
    vertices, faces = icosphere(3)
    origins = RNG.uniform(-1.5, 1.5, (4000, 3)).astype(np.float32)
    directions = RNG.normal(size=(4000, 3)).astype(np.float32)
    rays = origins, directions, np.full(4000, np.inf, np.float32)
    hits = clrt.RayQuery(vertices, faces, device=device.info.index).closest_hit(*rays)
    points, normals = surface_points(vertices, faces, rays, hits)
    hit = hits["primitive"] >= 0
    assert 0.2 < hit.mean() < 0.8 and len(points) == np.count_nonzero(hit)
    p0, p1, p2 = corners(vertices, faces[hits["primitive"][hit]]).transpose(1, 0, 2)
    plane = np.cross(p1 - p0, p2 - p0)
    o, d = origins[hit].astype(np.float64), directions[hit].astype(np.float64)
    t = np.einsum("ij,ij->i", p0 - o, plane) / np.einsum("ij,ij->i", d, plane)
    steep = np.abs(np.einsum("ij,ij->i", d, normals)) > 0.01 * np.linalg.norm(d, axis=1)
    np.testing.assert_allclose(points[steep], (o + t[:, None] * d)[steep], atol=2e-5)
    np.testing.assert_allclose(np.einsum("ij,ij->i", points - p0, normals), 0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-12)
    assert (np.einsum("ij,ij->i", d, normals) < 0).all()


def test_bounces_are_cosine_distributed() -> None:
    """cos²θ and the azimuth are uniform, and all rays are on the normal's side, for normals in all directions."""
    count = 100_000
    normals = on_the_sphere(count)
    _, directions, t_max = bounce_rays(RNG.uniform(-1, 1, (count, 3)), normals, seed=3)
    assert np.isinf(t_max).all()
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1, atol=1e-6)
    cosines = np.einsum("ij,ij->i", directions, normals)
    assert (cosines > -1e-6).all()
    tangents = np.cross(normals, [0.6, 0.0, 0.8])
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    across = np.einsum("ij,ij->i", directions, np.cross(normals, tangents))
    azimuth = np.arctan2(across, np.einsum("ij,ij->i", directions, tangents)) / (2 * np.pi) % 1
    cells = np.histogram2d(np.maximum(cosines, 0) ** 2, azimuth, bins=12, range=[[0, 1], [0, 1]])[0]
    assert chi2_test(cells, np.full((12, 12), count / 144)) > sidak(1e-3, 1)


def test_light_rays_end_just_before_the_light() -> None:
    points, light = RNG.uniform(-1, 1, (5000, 3)), np.array([0.3, 0.2, 5.0])
    normals = on_the_sphere(5000)
    seen = np.einsum("ij,ij->i", normals, light - points) > 0
    origins, directions, t_max = light_rays(points, normals, light)
    np.testing.assert_array_equal(origins, points[seen].astype(np.float32))
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1, atol=1e-6)
    ends = origins + t_max[:, None].astype(np.float64) * directions
    distances = np.linalg.norm(light - points[seen], axis=1)
    np.testing.assert_allclose(np.linalg.norm(light - ends, axis=1), GAP * distances, atol=2e-6)
    assert (t_max < distances).all()


def test_workloads_are_what_their_names_say(device: Device) -> None:
    ball = bumpy_ball(4)
    room = closed_room(*ball)
    query = clrt.RayQuery(*room, device=device.info.index)
    kinds = {kind.name: kind for kind in workloads(*room, ball[0], query.closest_hit, (120, 90))}
    assert {name: kind.any_hit for name, kind in kinds.items()} == {
        "primary": False,
        "bounce": False,
        "shadow": True,
        "occluded": True,
    }
    primary = query.closest_hit(*kinds["primary"].rays)["primitive"]
    assert len(primary) == 120 * 90 and (primary >= 0).all()
    assert 0.2 < np.mean(primary < len(ball[1])) < 0.8, "half ball, half wall"
    assert np.mean(query.closest_hit(*kinds["bounce"].rays)["primitive"] >= 0) > 0.999
    assert query.any_hit(*kinds["occluded"].rays).all(), "the light is inside the ball"
    assert 0.01 < query.any_hit(*kinds["shadow"].rays).mean() < 0.5
    assert min(len(kind.rays[2]) for kind in kinds.values()) > 120 * 90 // 4
