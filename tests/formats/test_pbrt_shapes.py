"""pbrt's shapes: areas, sides, subdivision."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clrt.formats.pbrt.loop_subdivision import subdivided

from .pbrt_files import TRIANGLE, scene

AREAS = [
    ('"sphere" "float radius" 2 "float zmin" -1 "float zmax" 1', 2 * np.pi * 2 * 2),
    ('"sphere" "float radius" 2 "float phimax" 90', np.pi * 4),
    ('"disk" "float radius" 2 "float innerradius" 1 "float height" 3', np.pi * 3),
    ('"cylinder" "float radius" 2 "float zmin" -2 "float zmax" 1 "float phimax" 180', 2 * np.pi * 3),
    ('"bilinearmesh" "point3 P" [0 0 0 2 0 0 0 3 0 2 3 0]', 6),
    ('"trianglemesh" "point3 P" [0 0 0 2 0 0 0 3 0] "integer indices" [0 1 2]', 3),
]


@pytest.mark.parametrize(("shape", "area"), AREAS, ids=lambda value: str(value)[:30])
def test_shapes(folder: Path, shape: str, area: float) -> None:
    """Area, and faces that are wound as their normals say."""
    mesh = scene(folder, f"Shape {shape}").meshes[0]
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.linalg.norm(cross, axis=1).sum() / 2 == pytest.approx(area, rel=3e-4)
    if mesh.normals is not None:
        solid = np.linalg.norm(cross, axis=1) > 1e-9
        assert np.all(np.einsum("ij,ij->i", cross, mesh.normals[mesh.faces].sum(1))[solid] > 0)


def front(folder: Path, world: str) -> Any:
    """The direction in which the first face of a scene's mesh emits."""
    mesh = scene(folder, world).meshes[0]
    a, b, c = mesh.vertices[mesh.faces[len(mesh.faces) // 2]].astype(np.float64)
    normal = np.cross(b - a, c - a)
    return normal / np.linalg.norm(normal)


def test_sides_that_emit(folder: Path) -> None:
    """cross(p1 − p0, p2 − p0), turned by ReverseOrientation and by normals, and for quadrics by mirroring."""
    np.testing.assert_allclose(front(folder, TRIANGLE), [0, 0, 1])
    np.testing.assert_allclose(front(folder, f"ReverseOrientation {TRIANGLE}"), [0, 0, -1])
    np.testing.assert_allclose(front(folder, f"Scale 1 -1 1 {TRIANGLE}"), [0, 0, 1])
    normals = f'{TRIANGLE} "normal N" [0 0 -1 0 0 -1 0 0 -1]'
    np.testing.assert_allclose(front(folder, normals), [0, 0, -1])
    np.testing.assert_allclose(front(folder, f"ReverseOrientation {normals}"), [0, 0, 1])
    np.testing.assert_allclose(front(folder, 'Shape "disk"'), [0, 0, 1], atol=1e-7)
    np.testing.assert_allclose(front(folder, 'Scale -1 1 1 Shape "disk"'), [0, 0, -1], atol=1e-7)
    np.testing.assert_allclose(front(folder, 'Scale -1 1 1 ReverseOrientation Shape "disk"'), [0, 0, 1], atol=1e-7)
    lit = scene(folder, 'AreaLightSource "diffuse" "bool twosided" true Shape "disk"').meshes[0].material
    assert lit.double_sided and lit.emission == (1, 1, 1)


def test_subdivision_converges_to_one_surface() -> None:
    """Vertices of each level are on the limit surface, so finer levels do not move them; planes stay planes."""
    rng = np.random.default_rng(3)
    ball = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], np.float64)
    faces = np.array([(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)])
    closed = ball + 0.2 * rng.normal(size=ball.shape)
    opened = faces[:5]
    for mesh in (faces, opened):
        coarse, _ = subdivided(closed, mesh, 1)
        fine, triangles = subdivided(closed, mesh, 3)
        np.testing.assert_allclose(fine[: len(coarse)], coarse, atol=1e-12)
        assert len(triangles) == len(mesh) * 64
    flat, _ = subdivided(closed * (1, 1, 0) + (0, 0, 2), opened, 2)
    np.testing.assert_allclose(flat[:, 2], 2)


def test_a_boundary_is_a_cubic_spline() -> None:
    """Of whose vertices the limit is (a + 4b + c)/6."""
    points = np.array([(0, 0, 0), (1, 0.5, 0), (2, -1, 0), (3, 0, 0), (1.5, 3, 0)], np.float64)
    faces = np.array([(0, 1, 4), (1, 2, 4), (2, 3, 4)])
    many, _ = subdivided(points, faces, 5)
    np.testing.assert_allclose(many[1], (points[0] + 4 * points[1] + points[2]) / 6, atol=1e-12)
