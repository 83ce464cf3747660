"""Closest hits in float64, every ray against every triangle: what answers in float32 rounding leaves open.

A line passes an edge on the side that their Plücker product says (Shoemake 1998, "Plücker coordinate tutorial"); of a
unit direction and a unit edge it is a length, their distance times the sine between them. A ray meets a triangle for
sure if it passes all three edges on the same side by more than `reach`, and maybe if it does by more than −reach.
A triangle without an area is never met.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .rays import Floats, Rays
from .workloads import Doubles, Faces

#: What float32 makes of a corner relative to the ray, in parts of how far from its origin the mesh reaches: some 20
#: roundings of 2^-24 (subtraction, shear, product, in two coordinates, at both ends of an edge, seen at √3), or 32.
ROUNDING = 2.0**-19
#: Rays at a time times triangles: 8 MB an array.
TESTS = 1 << 20
UNDECIDED = -2


class Bounds(NamedTuple):
    """What may be found: low <= t·|direction| <= high, (n,) float64, inf for no hit; primitive (n,) int64.

    primitive: the only one possible, −1 if no hit is, UNDECIDED where several are. Of copies it is the lowest.
    """

    low: Doubles
    high: Doubles
    primitive: NDArray[np.int64]

    def wrong(self, rays: Rays, hits: NDArray[Any]) -> NDArray[np.bool_]:
        """(n,) which records of `RayQuery.closest_hit` for the rays cannot be."""
        t = hits["t"] * np.linalg.norm(rays[1].astype(np.float64), axis=1)
        named = (self.primitive != UNDECIDED) & (self.primitive != hits["primitive"])
        return np.asarray(named | (t < self.low) | (t > self.high))


class _Triangles(NamedTuple):
    """Those with an area, each once. edges: three (m, 6), of unit edges; normals: unit; points: one of each, (m, 3).

    aspect: length of the longest edge over the least height; primitive: as the mesh counts; extent: of all corners.
    """

    edges: tuple[Doubles, Doubles, Doubles]
    normals: Doubles
    points: Doubles
    aspect: Doubles
    primitive: NDArray[np.int64]
    extent: float


def closest_bounds(vertices: Floats, faces: Faces, rays: Rays) -> Bounds:
    """The bounds of the closest hits of rays without an end."""
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
    return _Triangles((pluecker[:, 0], pluecker[:, 1], pluecker[:, 2]),
                      normals / np.linalg.norm(normals, axis=1, keepdims=True), p[:, 0],
                      lengths.max(axis=1)**2 / (2 * areas(p)), first,
                      float(np.linalg.norm(corners, axis=2).max(initial=0)))


def areas(corners: Doubles) -> Doubles:
    """(m,) of triangles (m, 3, 3)."""
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


def _met(triangles: _Triangles, origins: Doubles, directions: Doubles,
         reach: Doubles) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.bool_]]:
    """Rays and triangles that meet, sure or maybe, behind the origin as well: rows, columns, which are sure."""
    pluecker = np.concatenate([directions, np.cross(origins, directions)], axis=1)
    one, two, three = (pluecker @ edge.T for edge in triangles.edges)
    least = np.minimum(np.minimum(one, two), three)
    most = np.maximum(np.maximum(one, two, out=one), three, out=one)
    row, column = np.nonzero((least >= -reach[:, None]) | (most <= reach[:, None]))
    return row, column, (least[row, column] > reach[row]) | (most[row, column] < -reach[row])


def _distances(triangles: _Triangles, origins: Doubles, directions: Doubles, reach: Doubles, row: NDArray[np.intp],
               column: NDArray[np.intp]) -> tuple[Doubles, Doubles]:
    """Of pairs, the least and most t at which the plane may be met: slanted and narrow triangles leave much open."""
    normals = triangles.normals[column]
    cosine = np.einsum("ij,ij->i", normals, directions[row])
    distance = np.einsum("ij,ij->i", normals, triangles.points[column] - origins[row])
    with np.errstate(divide="ignore", invalid="ignore"):
        t, slack = distance / cosine, np.abs(triangles.aspect[column] * reach[row] / cosine)
        return np.where(cosine == 0, 0, t - slack), np.where(cosine == 0, np.inf, t + slack)
