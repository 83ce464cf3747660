"""Meshes as two plain arrays, checked."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import SceneError

Floats = NDArray[np.float32]


def mesh_arrays(vertices: ArrayLike, faces: ArrayLike) -> tuple[Floats, NDArray[np.int32]]:
    """vertices (n, 3) float32 and a copy of faces (m, 3) int32; SceneError for what is no mesh."""
    points, indices = finite_points(vertices), np.asarray(faces)
    if indices.ndim != 2 or indices.shape[1] != 3:
        raise SceneError(f"faces {indices.shape} must have the shape (m, 3)")
    if indices.size and indices.dtype.kind not in "iu":
        raise SceneError(f"faces has dtype {indices.dtype}; write whole numbers, such as int32")
    outside = (indices < 0) | (indices >= len(points))
    if outside.any():
        face = int(np.argmax(outside.any(axis=1)))
        raise SceneError(f"faces[{face}] = {indices[face].tolist()}: there are {len(points)} vertices; repair the mesh")
    return points, indices.astype(np.int32)


def finite_points(vertices: ArrayLike) -> Floats:
    """(n, 3) float32; SceneError for another shape, and for NaN and infinity."""
    points = np.asarray(vertices, np.float32)
    if points.ndim != 2 or points.shape[1] != 3:
        raise SceneError(f"vertices {points.shape} must have the shape (n, 3)")
    if not np.isfinite(points).all():
        row = int(np.argmin(np.isfinite(points).all(axis=1)))
        raise SceneError(f"vertices[{row}] = {points[row].tolist()} is not finite; repair the mesh")
    return points
