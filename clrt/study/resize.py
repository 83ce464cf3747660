"""The same surface in more or in fewer triangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .rays import Floats
from .workloads import Faces, Mesh, subdivide

#: Cells of the finest grid along the largest extent.
FINEST = 1 << 20
#: Meshes of no more triangles are as simple as can be.
SIMPLE = 1000


def resized(vertices: Floats, faces: Faces, triangles: int) -> Mesh:
    """The mesh in little more than so many triangles: simplified, subdivided, or first the one and then the other."""
    times = 0
    while len(faces) * 4**times < triangles:
        times += 1
    mesh = simplified(vertices, faces, -(-triangles // 4**times))
    for _ in range(times):
        mesh = subdivide(*mesh)
    return mesh


def simplified(vertices: Floats, faces: Faces, triangles: int) -> Mesh:
    """The mesh in little more than so many triangles; one of no more than SIMPLE stays as it is.

    By the coarsest grid that leaves them: vertices in one of its cubic cells become one, at their mean, and triangles
    that fall together vanish (Rossignac and Borrel 1993, "Multi-resolution 3D approximations for rendering complex
    scenes").
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
    """(n,) the cell of each vertex, `number` of them along the largest extent."""
    low = vertices.min(axis=0).astype(np.float64)
    extent = float((vertices.max(axis=0) - low).max())
    x, y, z = np.minimum(((vertices - low) * (number / extent)).astype(np.int64), number - 1).T
    return np.asarray((x * number + y) * number + z)


def _stays(corners: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Which triangles (m, 3) have three different corners."""
    a, b, c = corners.T
    return np.asarray((a != b) & (b != c) & (c != a))
