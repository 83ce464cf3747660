"""Meshes of surfaces that are functions of two coordinates."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...scene.model import Mesh

Doubles = NDArray[np.float64]


def grid(across: int, down: int) -> tuple[Doubles, Doubles]:
    """Return the coordinates from 0 to 1 of a grid's vertices, row by row."""
    v, u = np.divide(np.mgrid[: down + 1, : across + 1], np.array([down, across])[:, None, None]).reshape(2, -1)
    return u, v


def quads(across: int, down: int) -> NDArray[np.int64]:
    """Return two triangles per cell of a grid, wound from u to v."""
    corner = (np.arange(down)[:, None] * (across + 1) + np.arange(across)).reshape(-1, 1)
    below = corner + across + 1
    return np.concatenate([np.hstack([corner, corner + 1, below + 1]), np.hstack([corner, below + 1, below])])


def mesh_of(name: str, points: ArrayLike, faces: ArrayLike, uv: ArrayLike, normals: ArrayLike) -> Mesh:
    """Return a mesh of arrays of any dtype."""
    return Mesh(
        np.asarray(points, np.float32),
        np.ascontiguousarray(faces, np.int32),
        name=name,
        uv=np.asarray(uv, np.float32),
        normals=np.asarray(normals, np.float32),
    )
