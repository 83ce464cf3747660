from __future__ import annotations

import numpy as np
import pytest

from clrt.scene.geometry.normals import choose_normals, smooth_normals, weld

from .shapes import cube, icosphere

EPS = float(np.finfo(np.float32).eps)


@pytest.mark.parametrize("split", [False, True])
@pytest.mark.parametrize("scale", [1.0, 1e-20, 1e-30, 1e30])
def test_sphere_normals_are_within_the_cone_of_their_faces(split: bool, scale: float) -> None:
    """A vertex normal is a positive combination of face normals, so it deviates from the radius by at most the largest
    angle between a face's normal and its corners; unshared corners give the same normals."""
    vertices, faces = icosphere(2)
    a, b, c = vertices.astype(np.float64)[faces].transpose(1, 0, 2)
    face_normals = np.cross(b - a, c - a)
    face_normals /= np.linalg.norm(face_normals, axis=1, keepdims=True)
    cone = np.min(np.einsum("ij,ikj->ik", face_normals, vertices[faces]))
    if split:
        vertices, faces = vertices[faces].reshape(-1, 3), np.arange(faces.size, dtype=np.int32).reshape(-1, 3)
    normals = smooth_normals(vertices * np.float32(scale), faces)
    assert normals.dtype == np.float32 and normals.shape == vertices.shape
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=4 * EPS)
    assert np.einsum("ij,ij->i", normals, vertices).min() >= cone - 4 * EPS
    assert cone > 0.98


def test_cube_normals_do_not_depend_on_its_diagonals() -> None:
    """Three right angles meet in each corner, for any number of triangles: the normal is (±1, ±1, ±1)/√3."""
    vertices, faces = cube()
    np.testing.assert_allclose(smooth_normals(vertices, faces), vertices / 3**0.5, atol=4 * EPS)


def test_weld_against_a_dictionary() -> None:
    rng = np.random.default_rng(1)
    vertices = rng.choice(np.array([0.0, -0.0, 1.0, 1.0 + EPS, -1e-40], np.float32), (500, 3))
    points, count = weld(vertices)
    numbers: dict[tuple[float, ...], int] = {}
    for vertex, point in zip(vertices.tolist(), points.tolist()):
        assert numbers.setdefault(tuple(vertex), point) == point
    assert len(set(numbers.values())) == len(numbers) == count


def test_two_sided_sheet_and_triangles_without_area_get_unit_normals() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 5, 5]], np.float32)
    sheet = smooth_normals(vertices, np.array([[0, 1, 2], [0, 2, 1]], np.int32))
    np.testing.assert_array_equal(abs(sheet[:3]), [[0, 0, 1]] * 3)
    point = smooth_normals(vertices, np.array([[3, 3, 3]], np.int32))
    np.testing.assert_array_equal(point, [[0, 1, 0]] * 4)


def test_choice() -> None:
    vertices, faces = icosphere(0)
    stored = -2 * vertices
    stored[3], stored[5] = 0, np.nan
    assert choose_normals("flat", vertices, faces, stored) is None
    assert choose_normals("file", vertices, faces, None) is None
    smooth = choose_normals("smooth", vertices, faces, stored)
    assert smooth is not None
    np.testing.assert_allclose(smooth, vertices, atol=4 * EPS)  # an icosahedron's normals are exact by symmetry
    normals = choose_normals("file", vertices, faces, stored)
    assert normals is not None
    expected = -vertices
    expected[[3, 5]] *= -1
    np.testing.assert_allclose(normals, expected, atol=4 * EPS)
