"""Closest hits in float64 by brute force: the range of results that float32 rounding permits.

The sign of a Plücker product tells on which side of an edge a line passes (Shoemake 1998, "Plücker coordinate
tutorial"); for a unit direction and a unit edge its value is a length, their distance times the sine between them. A
ray certainly hits a triangle if it passes all three edges on the same side by more than `reach`, and possibly if by
more than −reach. A triangle of zero area is never hit.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..rays.ray_speed import Floats, Rays
from ..rays.workloads import Doubles, Faces

#: Error of a vertex relative to the ray in float32, in units of the mesh's farthest extent from the ray's origin: about
#: 20 roundings of 2^-24 (subtraction, shear, product, in two coordinates, at both ends of an edge, times √3), or 32.
ROUNDING = 2.0**-19
#: Rays per chunk times triangles: 8 MB per array.
TESTS = 1 << 20
UNDECIDED = -2


class Bounds(NamedTuple):
    """Permitted hits: low <= t·|direction| <= high, (n,) float64, inf for a miss; primitive (n,) int64.

    primitive: the only possible one, −1 if there is none, UNDECIDED if there are several; the lowest of duplicates.
    """

    low: Doubles
    high: Doubles
    primitive: NDArray[np.int64]

    def wrong(self, rays: Rays, hits: NDArray[Any]) -> NDArray[np.bool_]:
        """Return (n,) which records of `RayQuery.closest_hit` for the rays are outside the bounds."""
        t = hits["t"] * np.linalg.norm(rays[1].astype(np.float64), axis=1)
        named = (self.primitive != UNDECIDED) & (self.primitive != hits["primitive"])
        return np.asarray(named | (t < self.low) | (t > self.high))


class _Triangles(NamedTuple):
    """Distinct triangles with nonzero area. edges: three (m, 6), of unit edges; normals: unit; points: a vertex (m, 3).

    aspect: longest edge over smallest height; primitive: index in the mesh; extent: largest distance of all vertices.
    """

    edges: tuple[Doubles, Doubles, Doubles]
    normals: Doubles
    points: Doubles
    aspect: Doubles
    primitive: NDArray[np.int64]
    extent: float


def closest_bounds(vertices: Floats, faces: Faces, rays: Rays) -> Bounds:
    """Return the bounds of the closest hits of rays with infinite t_max."""
    triangles = _prepare(vertices[faces].astype(np.float64))
    parts = max(1, len(rays[2]) * len(faces) // TESTS)
    chunks = zip(*(np.array_split(array.astype(np.float64), parts) for array in rays[:2]))
    return Bounds(*map(np.concatenate, zip(*(_closest(triangles, *chunk) for chunk in chunks))))


def _prepare(corners: Doubles) -> _Triangles:
    _, first = np.unique(corners.reshape(-1, 9), axis=0, return_index=True)
    first = first[areas(corners[first]) > 0]
    p = corners[first]
    edges = np.roll(p, -1, axis=1) - p
    lengths = np.linalg.norm(edges, axis=2)
    pluecker = np.concatenate([np.cross(p, edges), edges], axis=2) / lengths[..., None]
    normals = np.cross(edges[:, 0], edges[:, 1])
    return _Triangles(
        (pluecker[:, 0], pluecker[:, 1], pluecker[:, 2]),
        normals / np.linalg.norm(normals, axis=1, keepdims=True),
        p[:, 0],
        lengths.max(axis=1) ** 2 / (2 * areas(p)),
        first,
        float(np.linalg.norm(corners, axis=2).max(initial=0)),
    )


def areas(corners: Doubles) -> Doubles:
    """Return the areas (m,) of triangles (m, 3, 3)."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.asarray(np.linalg.norm(normals, axis=1) / 2)


def _closest(triangles: _Triangles, origins: Doubles, directions: Doubles) -> Bounds:
    directions = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    reach = ROUNDING * (np.linalg.norm(origins, axis=1) + triangles.extent)
    row, column, sure = _met(triangles, origins, directions, reach)
    t_low, t_high = _distances(triangles, origins, directions, reach, row, column)
    sure &= t_low > 0
    low, high = np.full(len(reach), np.inf), np.full(len(reach), np.inf)
    ahead = t_high > 0
    np.minimum.at(low, row[ahead], t_low[ahead])
    np.minimum.at(high, row[sure], t_high[sure])
    possible = ahead & (t_low <= high[row])
    choices = np.bincount(row[possible], minlength=len(reach))
    primitive = np.where(choices == 0, -1, UNDECIDED)
    only = possible & sure & (choices[row] == 1)
    primitive[row[only]] = triangles.primitive[column[only]]
    return Bounds(low, high, primitive)


def _met(
    triangles: _Triangles, origins: Doubles, directions: Doubles, reach: Doubles
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.bool_]]:
    """Return rays (rows) and triangles (columns) of certain and possible hits, also at t < 0; and which are certain."""
    pluecker = np.concatenate([directions, np.cross(origins, directions)], axis=1)
    one, two, three = (pluecker @ edge.T for edge in triangles.edges)
    least = np.minimum(np.minimum(one, two), three)
    most = np.maximum(np.maximum(one, two, out=one), three, out=one)
    row, column = np.nonzero((least >= -reach[:, None]) | (most <= reach[:, None]))
    return row, column, (least[row, column] > reach[row]) | (most[row, column] < -reach[row])


def _distances(
    triangles: _Triangles,
    origins: Doubles,
    directions: Doubles,
    reach: Doubles,
    row: NDArray[np.intp],
    column: NDArray[np.intp],
) -> tuple[Doubles, Doubles]:
    """Return the smallest and largest t of pairs with the plane: uncertain for grazing rays and narrow triangles."""
    normals = triangles.normals[column]
    cosine = np.einsum("ij,ij->i", normals, directions[row])
    distance = np.einsum("ij,ij->i", normals, triangles.points[column] - origins[row])
    with np.errstate(divide="ignore", invalid="ignore"):
        t, slack = distance / cosine, np.abs(triangles.aspect[column] * reach[row] / cosine)
        return np.where(cosine == 0, 0, t - slack), np.where(cosine == 0, np.inf, t + slack)
