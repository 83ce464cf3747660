"""Point clouds: a small sphere of triangles in place of each point."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

log = logging.getLogger(__name__)
Doubles = NDArray[np.float64]
#: Of more points only every k-th is used.
MOST_POINTS = 2_000_000
#: The spheres are as fine as this number of triangles allows, up to FINEST subdivisions of an octahedron.
TRIANGLES = 4_000_000
FINEST = 3
#: Radius of a sphere, as a fraction of the edge of cubes that hold two points each on average.
FRACTION = 0.35
#: Bisections of that edge.
ROUNDS = 20


def point_spheres(path: Path, points: Doubles, radii: Doubles | None, colors: NDArray[Any] | None) -> dict[str, Any]:
    """Return trimesh's keyword arguments for the spheres of a file's points (n, 3).

    radii: (n,), or None to derive one from the spacing of the points; colors: (n, k), or None.

    Points that are not finite, and radii that are not positive, are ignored with a warning.
    """
    usable = np.isfinite(points).all(axis=1)
    if radii is not None:
        usable &= np.isfinite(radii) & (radii > 0)
    chosen = np.flatnonzero(usable)
    if ignored := len(points) - len(chosen):
        log.warning("%s: ignored: %d points without a finite position and a positive radius", path, ignored)
    if (step := -(-len(chosen) // MOST_POINTS)) > 1:
        log.warning("%s: %d points, of which every %d. is rendered, at most %d", path, len(chosen), step, MOST_POINTS)
        chosen = chosen[::step]
    points = points[chosen]
    radius = np.full(len(points), spacing_radius(points)) if radii is None else radii[chosen]
    directions, faces = _sphere(len(points))
    size = len(directions)
    return {
        "vertices": (points[:, None] + radius[:, None, None] * directions).reshape(-1, 3),
        "faces": (np.arange(len(points))[:, None, None] * size + faces).reshape(-1, 3),
        "vertex_normals": np.tile(directions, (len(points), 1)),
        "vertex_colors": None if colors is None else np.repeat(colors[chosen], size, axis=0),
    }


def spacing_radius(points: Doubles) -> float:
    """Return a radius for which the spheres of neighboring points nearly touch; 1 for a single point.

    The edge of the cubes of a grid is bisected until they hold two distinct points each on average.
    """
    if len(points) == 0 or not (extent := float(np.ptp(points, axis=0).max())):
        return 1.0
    low, high = -ROUNDS * 1.0, 0.0
    distinct = _occupied(points, extent * 2.0**low)
    for _ in range(ROUNDS):
        middle = (low + high) / 2
        if _occupied(points, extent * 2.0**middle) * 2 < distinct:
            high = middle
        else:
            low = middle
    return float(FRACTION * extent * 2.0**high)


def _occupied(points: Doubles, edge: float) -> int:
    """Return how many cubes of a grid contain points."""
    x, y, z = ((points - points.min(axis=0)) / edge).astype(np.int64).T
    return len(np.unique((x << 42) + (y << 21) + z))


def _sphere(number: int) -> tuple[Doubles, NDArray[np.int64]]:
    """Return the unit normals (k, 3) and faces of a sphere, as fine as so many of them may be."""
    vertices = np.concatenate([np.eye(3), -np.eye(3)])
    faces = np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]])
    for _ in range(FINEST):
        if 4 * len(faces) * number > TRIANGLES:
            break
        vertices, faces = _subdivided(vertices, faces)
    return vertices, faces


def _subdivided(vertices: Doubles, faces: NDArray[np.int64]) -> tuple[Doubles, NDArray[np.int64]]:
    """Split each triangle of a sphere into four."""
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2))
    pairs, middles = np.unique(edges, axis=0, return_inverse=True)
    ab, bc, ca = (middles.reshape(-1, 3) + len(vertices)).T
    a, b, c = faces.T
    between = vertices[pairs].sum(axis=1)
    between /= np.linalg.norm(between, axis=1, keepdims=True)
    pieces = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    return np.concatenate([vertices, between]), np.array(pieces).transpose(0, 2, 1).reshape(-1, 3)
