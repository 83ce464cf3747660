"""Meshes with known shapes for the tests of the scene package."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

Vertices = NDArray[np.float32]
Faces = NDArray[np.int32]


def icosphere(subdivisions: int) -> tuple[Vertices, Faces]:
    """Return the unit icosphere: an icosahedron subdivided `subdivisions` times, counter-clockwise seen from
    outside."""
    golden = (1 + 5**0.5) / 2
    points = [
        np.array(p, float)
        for a, b in itertools.product((-1, 1), (-golden, golden))
        for p in ((0, a, b), (a, b, 0), (b, 0, a))
    ]
    faces = [
        corners
        for corners in itertools.combinations(range(12), 3)
        if all(np.isclose(np.linalg.norm(points[i] - points[j]), 2) for i, j in itertools.combinations(corners, 2))
    ]
    points = [p / np.linalg.norm(p) for p in points]
    triangles = [[points[i] for i in corners] for corners in faces]
    for _ in range(subdivisions):
        triangles = [piece for a, b, c in triangles for piece in _quarters(a, b, c)]
    triangles = [[a, b, c] if np.dot(np.cross(b - a, c - a), a) > 0 else [a, c, b] for a, b, c in triangles]
    corners = np.array(triangles, np.float32).reshape(-1, 3).round(6)
    vertices, indices = np.unique(corners, axis=0, return_inverse=True)
    vertices = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    return vertices.astype(np.float32), indices.reshape(-1, 3).astype(np.int32)


def _quarters(
    a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]
) -> list[list[NDArray[np.float64]]]:
    ab, bc, ca = ((p + q) / np.linalg.norm(p + q) for p, q in ((a, b), (b, c), (c, a)))
    return [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]


def cube() -> tuple[Vertices, Faces]:
    """Return the cube [-1, 1]³ as 6 sides of 4 vertices each; every second side is split along its other diagonal."""
    vertices: list[NDArray[np.float64]] = []
    faces: list[list[int]] = []
    for axis, sign in itertools.product(range(3), (-1.0, 1.0)):
        first, second = np.roll(np.eye(3), axis, axis=1)[1:]
        first, normal = first * sign, np.cross(first * sign, second)
        base = len(vertices)
        vertices += [normal + a * first + b * second for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        cut = [[0, 1, 2], [0, 2, 3]] if sign > 0 else [[0, 1, 3], [1, 2, 3]]
        faces += [[base + corner for corner in face] for face in cut]
    return np.array(vertices, np.float32), np.array(faces, np.int32)


def volume(vertices: NDArray[np.floating], faces: Faces) -> float:
    """Return the volume of a closed surface, positive if its faces are counter-clockwise seen from outside."""
    a, b, c = vertices.astype(np.float64)[faces].transpose(1, 0, 2)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)
