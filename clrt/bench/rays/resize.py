"""Resampling of a mesh to more or fewer triangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .ray_speed import Floats
from .workloads import Faces, Mesh, subdivide

#: Cells of the finest grid along the largest extent.
FINEST = 1 << 20
#: Meshes with at most this many triangles are not simplified.
SIMPLE = 1000


def resized(vertices: Floats, faces: Faces, triangles: int) -> Mesh:
    """Return the mesh with slightly more than this number of triangles: simplified, subdivided, or both."""
    times = 0
    while len(faces) * 4**times < triangles:
        times += 1
    mesh = simplified(vertices, faces, -(-triangles // 4**times))
    for _ in range(times):
        mesh = subdivide(*mesh)
    return mesh


def simplified(vertices: Floats, faces: Faces, triangles: int) -> Mesh:
    """Return the mesh with slightly more than this number of triangles; one with at most SIMPLE is unchanged.

    Uses the coarsest grid that leaves enough triangles: the vertices in a cubic cell are merged to their mean, and
    triangles that degenerate are removed (Rossignac and Borrel 1993, "Multi-resolution 3D approximations for rendering
    complex scenes").
    """
    if len(faces) <= max(triangles, SIMPLE):
        return vertices, faces
    coarse, fine = 1, FINEST
    while fine - coarse > 1:
        middle = (coarse + fine) // 2
        leaves = np.count_nonzero(_stays(_cells(vertices, middle)[faces])) >= triangles
        coarse, fine = (coarse, middle) if leaves else (middle, fine)
    _, cell, count = np.unique(_cells(vertices, fine), return_inverse=True, return_counts=True)
    means = np.stack([np.bincount(cell, vertices[:, axis]) / count for axis in range(3)], axis=1)
    return means.astype(np.float32), cell[faces[_stays(cell[faces])]].astype(np.int32)


def _cells(vertices: Floats, number: int) -> NDArray[np.int64]:
    """Return the cell of each vertex, (n,), with `number` cells along the largest extent."""
    low = vertices.min(axis=0).astype(np.float64)
    extent = float((vertices.max(axis=0) - low).max())
    x, y, z = np.minimum(((vertices - low) * (number / extent)).astype(np.int64), number - 1).T
    return np.asarray((x * number + y) * number + z)


def _stays(corners: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Return which triangles (m, 3) have three different vertices."""
    a, b, c = corners.T
    return np.asarray((a != b) & (b != c) & (c != a))
