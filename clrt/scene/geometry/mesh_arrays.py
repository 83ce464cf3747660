"""Validation of meshes given as two plain arrays, and of spheres given as one."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...errors import SceneError
from ..fields.number_arrays import real_array, whole_array

Floats = NDArray[np.float32]
Points = NDArray[np.float32] | NDArray[np.float64]


def mesh_arrays(vertices: ArrayLike, faces: ArrayLike) -> tuple[Points, NDArray[np.int32]]:
    """Return vertices (n, 3) float32 or float64 and a copy of faces (m, 3) int32; SceneError if they are invalid."""
    points, indices = finite_points(vertices), whole_array("faces", faces, SceneError)
    if indices.ndim != 2 or indices.shape[1] != 3:
        raise SceneError(f"faces {indices.shape} must have the shape (m, 3)")
    outside = (indices < 0) | (indices >= len(points))
    if outside.any():
        face = int(np.argmax(outside.any(axis=1)))
        raise SceneError(
            f"faces[{face}] = {indices[face].tolist()}: the mesh has {len(points)} vertices, counted from "
            "0; repair the mesh"
        )
    return points, indices.astype(np.int32)


def finite_points(vertices: ArrayLike) -> Points:
    """Return points (n, 3), float64 if given so, otherwise float32. Raises SceneError for another shape, and for values
    that are not finite in float32."""
    given = real_array("vertices", vertices, SceneError)
    with np.errstate(over="ignore"):
        points = given.astype(np.float32)
    if points.ndim != 2 or points.shape[1] != 3:
        raise SceneError(f"vertices {points.shape} must have the shape (n, 3)")
    if not np.isfinite(points).all():
        row = int(np.argmin(np.isfinite(points).all(axis=1)))
        raise SceneError(f"vertices[{row}] = {given[row].tolist()} is not finite in float32; repair the mesh")
    return given if given.dtype == np.float64 else points


def sphere_array(spheres: ArrayLike) -> Floats:
    """Return spheres (s, 4) float32, center and radius. Raises SceneError for another shape, values that are not
    finite, and radii not above 0."""
    given = real_array("spheres", spheres, SceneError)
    with np.errstate(over="ignore"):
        table = given.astype(np.float32)
    if table.ndim != 2 or table.shape[1] != 4:
        raise SceneError(f"spheres {table.shape} must have the shape (s, 4), center and radius")
    good = np.isfinite(table).all(axis=1) & (table[:, 3] > 0)
    if not good.all():
        row = int(np.argmin(good))
        raise SceneError(f"spheres[{row}] = {given[row].tolist()} must be finite in float32, with a radius above 0")
    return table
