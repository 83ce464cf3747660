"""Mitsuba's analytic shapes as triangle meshes with its texture coordinates, before any transform."""

from __future__ import annotations

import numpy as np

from ...scene.model import Mesh
from ..scene_parts.grids import grid, mesh_of, quads

#: Segments around a full turn, and from pole to pole or from a disk's center to its rim; the largest gap between a
#: circle and its polygon's edges is 1.5e-4 of the radius.
TURN, ACROSS = 256, 128


def rectangle() -> Mesh:
    """Return the square from −1 to 1 in x and y, facing +z."""
    corners = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float64)
    return mesh_of(
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
    return mesh_of(
        "cube",
        points,
        np.concatenate([first + (0, 1, 2), first + (3, 0, 2)]),
        np.tile([(0, 1), (1, 1), (1, 0), (0, 0)], (6, 1)),
        np.repeat(normals, 4, axis=0),
    )


def sphere() -> Mesh:
    """Return the sphere of radius 1; u goes around z from +x, v from +z to −z."""
    u, v = grid(TURN, ACROSS)
    phi, theta = 2 * np.pi * u, np.pi * v
    points = np.column_stack([np.cos(phi) * np.sin(theta), np.sin(phi) * np.sin(theta), np.cos(theta)])
    return mesh_of("sphere", points, quads(TURN, ACROSS)[:, ::-1], np.column_stack([u, v]), points)


def disk() -> Mesh:
    """Return the disk of radius 1, facing +z; u is the distance from the center, v goes around from +x."""
    turn, out = grid(TURN, ACROSS)
    phi = 2 * np.pi * turn
    points = np.column_stack([out * np.cos(phi), out * np.sin(phi), np.zeros(len(out))])
    return mesh_of(
        "disk",
        points,
        quads(TURN, ACROSS)[:, ::-1],
        np.column_stack([out, turn]),
        np.tile((0.0, 0.0, 1.0), (len(out), 1)),
    )


def cylinder() -> Mesh:
    """Return the cylinder of radius 1 about z, from 0 to 1, open at both ends; u goes around from +x, v along z."""
    u, v = grid(TURN, 1)
    around = np.column_stack([np.cos(2 * np.pi * u), np.sin(2 * np.pi * u)])
    return mesh_of(
        "cylinder",
        np.column_stack([around, v]),
        quads(TURN, 1),
        np.column_stack([u, v]),
        np.column_stack([around, np.zeros(len(u))]),
    )
