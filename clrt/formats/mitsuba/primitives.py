"""Mitsuba's analytic shapes as triangle meshes with its texture coordinates, before any transform."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...scene.model import Mesh

Doubles = NDArray[np.float64]

#: Segments around a full turn, and from pole to pole or from a disk's center to its rim; the largest gap between a
#: circle and its polygon's edges is 1.5e-4 of the radius.
TURN, ACROSS = 256, 128


def rectangle() -> Mesh:
    """Return the square from −1 to 1 in x and y, facing +z."""
    corners = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float64)
    return _mesh(
        "rectangle",
        np.column_stack([2 * corners - 1, np.zeros(4)]),
        [(0, 1, 2), (0, 2, 3)],
        corners,
        np.tile((0.0, 0.0, 1.0), (4, 1)),
    )


def cube() -> Mesh:
    """Return the cube from −1 to 1 in each axis; each side shows the whole texture."""
    normals = np.array([(0, -1, 0), (0, 1, 0), (1, 0, 0), (0, 0, 1), (-1, 0, 0), (0, 0, -1)], np.float64)
    corners = np.array([1, 5, 4, 0, 3, 2, 6, 7, 1, 3, 7, 5, 5, 7, 6, 4, 4, 6, 2, 0, 3, 1, 0, 2])
    points = 2.0 * np.column_stack([corners & 1, corners >> 1 & 1, corners >> 2]) - 1
    first = 4 * np.arange(6)[:, None]
    return _mesh(
        "cube",
        points,
        np.concatenate([first + (0, 1, 2), first + (3, 0, 2)]),
        np.tile([(0, 1), (1, 1), (1, 0), (0, 0)], (6, 1)),
        np.repeat(normals, 4, axis=0),
    )


def sphere() -> Mesh:
    """Return the sphere of radius 1; u goes around z from +x, v from +z to −z."""
    u, v = _grid(TURN, ACROSS)
    phi, theta = 2 * np.pi * u, np.pi * v
    points = np.column_stack([np.cos(phi) * np.sin(theta), np.sin(phi) * np.sin(theta), np.cos(theta)])
    return _mesh("sphere", points, _quads(TURN, ACROSS)[:, ::-1], np.column_stack([u, v]), points)


def disk() -> Mesh:
    """Return the disk of radius 1, facing +z; u is the distance from the center, v goes around from +x."""
    turn, out = _grid(TURN, ACROSS)
    phi = 2 * np.pi * turn
    points = np.column_stack([out * np.cos(phi), out * np.sin(phi), np.zeros(len(out))])
    return _mesh(
        "disk",
        points,
        _quads(TURN, ACROSS)[:, ::-1],
        np.column_stack([out, turn]),
        np.tile((0.0, 0.0, 1.0), (len(out), 1)),
    )


def cylinder() -> Mesh:
    """Return the cylinder of radius 1 about z, from 0 to 1, open at both ends; u goes around from +x, v along z."""
    u, v = _grid(TURN, 1)
    around = np.column_stack([np.cos(2 * np.pi * u), np.sin(2 * np.pi * u)])
    return _mesh(
        "cylinder",
        np.column_stack([around, v]),
        _quads(TURN, 1),
        np.column_stack([u, v]),
        np.column_stack([around, np.zeros(len(u))]),
    )


def _grid(across: int, down: int) -> tuple[Doubles, Doubles]:
    """Return the coordinates from 0 to 1 of a grid's vertices, row by row."""
    v, u = np.divide(np.mgrid[: down + 1, : across + 1], np.array([down, across])[:, None, None]).reshape(2, -1)
    return u, v


def _quads(across: int, down: int) -> NDArray[np.int64]:
    """Return two triangles per cell of a grid, wound from u to v."""
    corner = (np.arange(down)[:, None] * (across + 1) + np.arange(across)).reshape(-1, 1)
    below = corner + across + 1
    return np.concatenate([np.hstack([corner, corner + 1, below + 1]), np.hstack([corner, below + 1, below])])


def _mesh(name: str, points: ArrayLike, faces: ArrayLike, uv: ArrayLike, normals: ArrayLike) -> Mesh:
    return Mesh(
        np.asarray(points, np.float32),
        np.ascontiguousarray(faces, np.int32),
        name=name,
        uv=np.asarray(uv, np.float32),
        normals=np.asarray(normals, np.float32),
    )
