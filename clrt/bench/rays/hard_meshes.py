"""Meshes that are hard to intersect consistently: many edges hit by rays, duplicates, triangles of zero area."""

from __future__ import annotations

import numpy as np

from .workloads import Mesh, subdivide

#: Coordinates of the soup are multiples of this, so that collinear vertices are exactly collinear.
GRAIN = 2.0**-12


def icosphere(subdivisions: int) -> Mesh:
    """Return a closed unit sphere of 20·4^subdivisions triangles: an icosahedron, subdivided and projected."""
    golden = (1 + 5**0.5) / 2
    vertices = np.array([p for a in (-1, 1) for b in (-golden, golden) for p in ((0, a, b), (a, b, 0), (b, 0, a))])
    i, j, k = np.array([(i, j, k) for i in range(12) for j in range(i) for k in range(j)]).T
    edges = [np.linalg.norm(vertices[a] - vertices[b], axis=1) for a, b in ((i, j), (j, k), (k, i))]
    faces = np.stack([i, j, k], axis=1)[np.all(np.isclose(edges, 2), axis=0)]
    corners = vertices[faces]
    inwards = np.einsum("fi,fi->f", np.cross(corners[:, 1], corners[:, 2]), corners[:, 0]) < 0
    faces[inwards] = faces[inwards, ::-1]
    mesh = vertices.astype(np.float32), faces.astype(np.int32)
    for step in range(subdivisions + 1):
        points, faces = subdivide(*mesh) if step else mesh
        mesh = (points / np.linalg.norm(points, axis=1, keepdims=True)).astype(np.float32), faces
    return mesh


def soup(count: int, seed: int = 0) -> Mesh:
    """Return `count` intersecting triangles of all sizes in a cube of edge 2.

    A tenth has zero area: half of these repeat a vertex, half have collinear vertices. An eighth are duplicates of
    others, three of each, and all are in random order.
    """
    rng = np.random.default_rng(seed)
    sizes = 10 ** rng.uniform(-2, 0, (count, 1, 1))
    corners = rng.uniform(-1, 1, (count, 1, 3)) + sizes * rng.normal(size=(count, 3, 3))
    corners = GRAIN * np.round(corners / GRAIN)
    corners[::20, 2] = 2 * corners[::20, 1] - corners[::20, 0]
    faces = np.arange(3 * count).reshape(count, 3)
    faces[10::20, 2] = faces[10::20, 0]
    copies = count // 24
    faces[count - 3 * copies :] = np.tile(faces[:copies], (3, 1))
    return corners.reshape(-1, 3).astype(np.float32), rng.permutation(faces).astype(np.int32)
