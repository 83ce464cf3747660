"""Meshes of the studies: sizes, closedness, and the duplicates and degenerate triangles they are documented to have."""

from __future__ import annotations

from collections import Counter
from fractions import Fraction

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.bench.numerics.aimed_rays import rays_of_kinds
from clrt.bench.rays.hard_meshes import icosphere, soup
from clrt.bench.rays.ray_speed import Floats
from clrt.bench.rays.resize import SIMPLE, resized, simplified
from clrt.bench.rays.workloads import Faces, bumpy_ball


def areas(vertices: Floats, faces: Faces) -> NDArray[np.float64]:
    p0, p1, p2 = vertices.astype(np.float64)[faces].transpose(1, 0, 2)
    return np.asarray(np.linalg.norm(np.cross(p1 - p0, p2 - p0), axis=1) / 2)


@pytest.mark.parametrize("subdivisions", [0, 3])
def test_icosphere_is_a_closed_sphere_of_even_triangles(subdivisions: int) -> None:
    vertices, faces = icosphere(subdivisions)
    assert len(faces) == 20 * 4**subdivisions and len(vertices) == len(faces) // 2 + 2, "Euler's formula"
    edges = Counter(map(tuple, np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1).tolist()))
    assert set(edges.values()) == {2}
    directed = set(map(tuple, faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2).tolist()))
    assert len(directed) == 3 * len(faces), "all faces turn the same way"
    corners = vertices[faces].astype(np.float64)
    volume = np.linalg.det(corners).sum() / 6
    assert 0.6 * 4 / 3 * np.pi < volume < 4 / 3 * np.pi, "outwards"
    np.testing.assert_allclose(np.linalg.norm(vertices, axis=1), 1, atol=1e-6)
    assert areas(vertices, faces).max() < 2 * areas(vertices, faces).min()
    if subdivisions == 0:
        edge = 4 / (10 + 2 * 5**0.5) ** 0.5
        assert areas(vertices, faces).sum() == pytest.approx(5 * 3**0.5 * edge**2)


def exact_area_is_zero(corners: Floats) -> bool:
    p0, p1, p2 = [[Fraction(float(x)) for x in corner] for corner in corners]
    a, b = ([x - y for x, y in zip(p, p0)] for p in (p1, p2))
    return all(a[i] * b[j] == a[j] * b[i] for i, j in ((0, 1), (1, 2), (2, 0)))


def test_soup_has_copies_and_triangles_without_area() -> None:
    vertices, faces = soup(480)
    assert faces.shape == (480, 3)
    flat = np.array([exact_area_is_zero(corners) for corners in vertices[faces]])
    assert 40 <= flat.sum() <= 60
    twice = (faces == np.roll(faces, 1, axis=1)).any(axis=1)
    assert 15 < np.sum(flat & twice) < 35 and 15 < np.sum(flat & ~twice) < 35
    assert sorted(Counter(map(tuple, faces.tolist())).values()) == [1] * 400 + [4] * 20
    sizes = np.sqrt(areas(vertices, faces)[~flat])
    assert sizes.max() > 30 * sizes.min()


@pytest.mark.parametrize("triangles", [2000, 9000, 12288, 30_000])
def test_resized_mesh_is_of_the_size_and_shape(triangles: int) -> None:
    """Slightly more triangles than requested, on the surface of a sphere of radius near 1, without repeated corners."""
    vertices, faces = resized(*bumpy_ball(5), triangles)
    assert triangles <= len(faces) < 1.2 * triangles
    assert np.isin(np.arange(len(vertices)), faces).all()
    radii = np.linalg.norm(vertices, axis=1)
    assert 0.8 < radii.min() and radii.max() < 1.12
    assert areas(vertices, faces).sum() == pytest.approx(areas(*bumpy_ball(5)).sum(), rel=0.05)
    assert (faces != np.roll(faces, 1, axis=1)).all()


def test_small_meshes_are_only_subdivided() -> None:
    mesh = icosphere(0)
    assert len(simplified(*mesh, 5)[1]) == 20 <= SIMPLE
    assert len(resized(*mesh, 300)[1]) == 320


def test_aimed_rays_go_where_they_say() -> None:
    vertices, faces = icosphere(2)
    kinds = rays_of_kinds(vertices, faces, 500)
    assert list(kinds) == ["random", "vertices", "edges", "axes"]
    ends = {name: origins.astype(np.float64) + directions for name, (origins, directions, _) in kinds.items()}
    distances = np.linalg.norm(ends["vertices"][:, None] - vertices, axis=2)
    assert distances.min(axis=1).max() < 1e-6
    a, b = (vertices[faces[:, k]].astype(np.float64) for k in ((0, 1, 2), (1, 2, 0)))
    a, b = a.reshape(-1, 3), b.reshape(-1, 3)
    along = np.clip(np.einsum("nmk,mk->nm", ends["edges"][:, None] - a, b - a) / ((b - a) ** 2).sum(1), 0, 1)
    beside = ends["edges"][:, None] - a - along[..., None] * (b - a)
    assert np.linalg.norm(beside, axis=2).min(axis=1).max() < 1e-6
    assert np.linalg.norm(kinds["edges"][0], axis=1).max() < 0.31, "from the inside"
    origins, directions, _ = kinds["axes"]
    assert (np.sort(np.abs(directions), axis=1) == [0, 0, 1]).all()
    assert np.signbit(directions[directions == 0]).mean() == pytest.approx(0.5, abs=0.1)
    shared = (origins[:, None] == vertices).sum(axis=2).max(axis=1)
    assert 150 < np.sum(shared >= 2) < 350, "half of them run through a vertex"
