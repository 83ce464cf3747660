"""A closed surface with integer vertices around the origin, and rays whose hits are known exactly.

The surface is the grid on a cube's sides with each point scaled by an integer factor. For any factors, a ray from the
origin hits the triangle, edge or vertex in its direction, and nothing else: a direction that is the sum of a triangle's
vertices with integer weights of sum W hits it at t = 1/W.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Integers = NDArray[np.int64]
Doubles = NDArray[np.float64]

#: Squares along an edge of the cube, a multiple of 2, and the range of the factors.
SQUARES, FACTORS = 16, (16, 21)
#: Weights of a triangle's vertices that give ray directions, and what these rays hit (see Rays).
WEIGHTS = np.array([(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (0, 1, 1), (1, 0, 1), (2, 3, 4)])
MET = np.array([(0, 0, 0), (1, 1, 1), (2, 2, 2), (0, 1, 1), (1, 2, 2), (2, 0, 0), (0, 1, 2)])
#: Minimum distance, in barycentric coordinates, t and the cosine, of rays from elsewhere to ambiguous cases.
CLEAR = 0.01


class StarMesh(NamedTuple):
    """The closed surface. vertices: (n, 3); faces: (m, 3), counter-clockwise seen from outside."""

    vertices: Integers
    faces: Integers


class Rays(NamedTuple):
    """Rays with exact hits. origins, directions: (n, 3) integers, exact in float32, and zeros of both signs.

    t: (n,), the first hit, inf for a miss. corners: (n, 3), the vertices of the triangle that is hit; a vertex listed
    twice is an end of the edge that is hit, three times the vertex that is hit; −1 for a miss.
    """

    origins: Doubles
    directions: Doubles
    t: Doubles
    corners: Integers

    def take(self, order: Integers | slice) -> Rays:
        """Return some of the rays, or all in another order."""
        return Rays(self.origins[order], self.directions[order], self.t[order], self.corners[order])


def make_star(squares: int = SQUARES) -> StarMesh:
    """Return the surface, with the same factors every time: 12 · squares² triangles."""
    half = squares // 2
    grid = np.stack(np.meshgrid(*[np.arange(-half, half + 1)] * 3, indexing="ij"), axis=-1)
    outside = np.abs(grid).max(axis=-1) == half
    number = np.cumsum(outside).reshape(outside.shape) - 1
    factors = np.random.default_rng(7).integers(*FACTORS, (outside.sum(), 1))
    sides = []
    for axis in range(3):
        for side in (0, squares):
            square = np.moveaxis(number, (axis, (axis + 1) % 3, (axis + 2) % 3), (0, 1, 2))[side]
            a, b, c, d = square[:-1, :-1], square[1:, :-1], square[1:, 1:], square[:-1, 1:]
            triangles = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
            sides.append(triangles if side else triangles[:, ::-1])
    return StarMesh(grid[outside] * factors, np.concatenate(sides))


def rays_from_inside(star: StarMesh) -> Rays:
    """Return rays from the origin through each triangle: to its vertices, its edges' middles, and its interior."""
    n = len(star.faces) * len(WEIGHTS)
    directions = np.einsum("wk,fkx->fwx", WEIGHTS, star.vertices[star.faces]).reshape(n, 3)
    zeros = 0.0 * np.random.default_rng(8).choice([1, -1], (n, 3))
    t = np.tile(1 / WEIGHTS.sum(axis=1), len(star.faces))
    return Rays(zeros, np.where(directions == 0, zeros, directions), t, star.faces[:, MET].reshape(n, 3))


def rays_from_elsewhere(star: StarMesh, count: int) -> Rays:
    """Return up to `count` rays between integer points in and around the surface, tested exactly with all triangles."""
    rng, size = np.random.default_rng(9), int(np.abs(star.vertices).max())
    origins, targets = rng.integers(-2 * size, 2 * size, (2, count, 3))
    origins[::2] //= 16
    t, least, cosine = intersect_planes(star, origins, targets - origins)
    far = (least < -CLEAR) | (t < -CLEAR)
    clear = np.all(far | (least > CLEAR) & (t > CLEAR) & (np.abs(cosine) > CLEAR), axis=1)
    t = np.where(far, np.inf, t)[clear]
    first = t.argmin(axis=1)
    nearest = t[np.arange(len(t)), first]
    corners = np.where(np.isfinite(nearest)[:, None], star.faces[first], -1)
    directions = (targets - origins)[clear]
    return Rays(origins[clear].astype(np.float64), directions.astype(np.float64), nearest, corners)


def intersect_planes(star: StarMesh, origins: Integers, directions: Integers) -> tuple[Doubles, Doubles, Doubles]:
    """Return (n, m) each: t at the triangles' planes, the least barycentric coordinate there, and the cosine.

    All are quotients of integers below 2^53, which are exact.
    """
    p0, p1, p2 = star.vertices[star.faces].transpose(1, 0, 2)
    normals = np.cross(p1 - p0, p2 - p0)
    facing = directions @ normals.T
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (np.sum(normals * p0, axis=1) - origins @ normals.T) / facing
        moments = np.cross(origins, directions)
        least = np.full(t.shape, np.inf)
        for a, b in ((p0, p1), (p1, p2), (p2, p0)):  # from the volume that the ray spans with the opposite edge
            volume = directions @ np.cross(a, b).T + moments @ (b - a).T
            least = np.minimum(least, volume / facing)
    lengths = np.linalg.norm(directions, axis=1)[:, None] * np.linalg.norm(normals, axis=1)
    return t, least, facing / lengths
