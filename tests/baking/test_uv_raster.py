"""Faces over texels: coverage by separating axes, nearest points by trimesh, overlaps."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from clrt.baking import uv_raster
from clrt.baking.triangle_points import nearest_weights
from clrt.baking.uv_raster import texel_faces

from ..covering import others
from ..oracle.scenes import todays_seed

Doubles = NDArray[np.float64]


def distances(corners: Doubles, points: Doubles) -> Doubles:
    """Return the distances (m, n) of points (n, 2) from triangles (m, 3, 2)."""
    flat, places = (np.pad(each, [(0, 0)] * (each.ndim - 1) + [(0, 1)]) for each in (corners, points))
    nearest = trimesh.triangles.closest_point(np.repeat(flat, len(points), 0), np.tile(places, (len(corners), 1)))
    away: Doubles = np.linalg.norm(nearest - np.tile(places, (len(corners), 1)), axis=1)
    return away.reshape(len(corners), len(points))


def touches(triangle: Doubles, x: int, y: int) -> bool:
    """Return whether no axis separates a triangle (3, 2) from a texel (Gottschalk et al. 1996)."""
    square = np.array([(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)], float)
    edges = np.roll(triangle, -1, axis=0) - triangle
    axes = np.concatenate([np.eye(2), edges @ [[0, 1], [-1, 0]]])
    axes = axes[axes.any(axis=1)]  # corners may coincide
    ours, its = triangle @ axes.T, square @ axes.T
    return bool(((ours.min(0) < its.max(0)) & (its.min(0) < ours.max(0))).all())


def triangles(random: np.random.Generator, size: tuple[int, int]) -> Doubles:
    """Return triangles of many sizes and shapes."""
    reach = 10.0 ** random.uniform(-2, 1, (40, 1, 1))
    middle = random.uniform(0, 1, (40, 1, 2)) * size
    corners = middle + random.normal(0, 1, (40, 3, 2)) * reach
    corners[::5, 2] = corners[::5, 1] + random.normal(0, 1e-3, (8, 2))  # slivers
    return np.clip(corners, 0.01, np.array(size) - 0.01)


@pytest.mark.parametrize("texels", [7, *others(uv_raster.TEXELS)])
def test_each_texel_has_the_nearest_of_the_faces_that_cover_it(monkeypatch: pytest.MonkeyPatch, texels: int) -> None:
    monkeypatch.setattr(uv_raster, "TEXELS", texels)
    monkeypatch.setattr(uv_raster, "ROWS", texels)
    random = np.random.default_rng(todays_seed())
    size = width, height = 9, 7
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    centers = np.stack([x, y], axis=-1).reshape(-1, 2) + 0.5
    places = np.array([(0.5, 0.5), (0.9, 0.2)])
    for _ in range(20):
        corners = triangles(random, size)
        faces = random.permutation(1000)[: len(corners)]
        found = texel_faces(corners, faces, size, places).face.reshape(-1, 2)
        covers = np.array([[touches(each, int(i), int(j)) for i, j in zip(x.flat, y.flat)] for each in corners])
        assert np.array_equal(found[:, 0] >= 0, covers.any(axis=0))
        for number, place in enumerate(places):
            away = np.where(covers, distances(corners, centers - 0.5 + place), np.inf)
            drawn = np.flatnonzero(found[:, number] >= 0)
            rows = [np.flatnonzero(faces == face)[0] for face in found[drawn, number]]
            np.testing.assert_allclose(away[rows, drawn], away.min(axis=0)[drawn], atol=1e-6)


def test_weights_are_those_of_the_nearest_points() -> None:
    random = np.random.default_rng(todays_seed())
    corners, points = random.normal(size=(200, 3, 2)), random.normal(size=(200, 2)) * 2
    weights = nearest_weights(corners, points)
    np.testing.assert_allclose(weights.sum(axis=1), 1, rtol=1e-12)
    assert weights.min() >= 0
    away = np.linalg.norm((weights[:, :, None] * corners).sum(axis=1) - points, axis=1)
    np.testing.assert_allclose(away, np.diagonal(distances(corners, points)), atol=1e-9)


def test_overlaps_are_counted_but_not_shared_edges() -> None:
    square = np.array([[[0, 0], [8, 0], [8, 8]], [[0, 0], [8, 8], [0, 8]]], float)
    assert texel_faces(square, np.arange(2), (8, 8), np.full((1, 2), 0.5)).overlaps == 0
    assert (
        texel_faces(np.concatenate([square, square]), np.arange(4), (8, 8), np.full((1, 2), 0.5)).overlaps == 56
    )  # not on the diagonal
    corner = np.array([[[0, 0], [3, 0], [3, 3]], [[0, 0], [3, 3], [0, 3]]], float)
    assert texel_faces(np.concatenate([square, corner]), np.arange(4), (8, 8), np.full((1, 2), 0.5)).overlaps == 6
