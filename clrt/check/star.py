"""A closed surface of whole-numbered corners around the origin, and rays whose hits are known exactly.

The surface is the grid on a cube's sides with each point moved out by a whole factor. Whatever the factors, a ray from
the origin meets the triangle, edge or corner in whose direction it runs, and nothing else: a direction that is the sum
of a triangle's corners with whole weights of sum W meets it at t = 1/W.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Integers = NDArray[np.int64]
Doubles = NDArray[np.float64]

#: Squares along an edge of the cube, a multiple of 2, and what its points are multiplied by.
SQUARES, FACTORS = 16, (16, 21)
#: Of a triangle's corners the sums in whose directions rays run, and what they meet there (see Rays).
WEIGHTS = np.array([(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (0, 1, 1), (1, 0, 1), (2, 3, 4)])
MET = np.array([(0, 0, 0), (1, 1, 1), (2, 2, 2), (0, 1, 1), (1, 2, 2), (2, 0, 0), (0, 1, 2)])
#: So far, in barycentric coordinates, t and the cosine, rays from elsewhere keep from all that is hard to tell.
CLEAR = 0.01


class Star(NamedTuple):
    """vertices: (n, 3); faces: (m, 3), counter-clockwise seen from outside."""

    vertices: Integers
    faces: Integers


class Rays(NamedTuple):
    """origins, directions: (n, 3) whole numbers, in float32 exact, and zeros of both signs.

    t: (n,) where they hit first, inf where they miss. corners: (n, 3), the vertices whose triangle they hit; one that
    stands there twice is the end of the edge, one three times the corner, that they hit; −1 where they miss.
    """

    origins: Doubles
    directions: Doubles
    t: Doubles
    corners: Integers

    def take(self, order: Integers | slice) -> Rays:
        """Some of the rays, or all in another order."""
        return Rays(self.origins[order], self.directions[order], self.t[order], self.corners[order])


def make_star(squares: int = SQUARES) -> Star:
    """The surface, with the same factors every time: 12 triangles for each of an edge's squares times as many."""
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
    return Star(grid[outside] * factors, np.concatenate(sides))


def rays_from_inside(star: Star) -> Rays:
    """From the origin through every triangle: to its corners, to the middles of its edges, and inside; one by one."""
    n = len(star.faces) * len(WEIGHTS)
    directions = np.einsum("wk,fkx->fwx", WEIGHTS, star.vertices[star.faces]).reshape(n, 3)
    zeros = 0.0 * np.random.default_rng(8).choice([1, -1], (n, 3))
    t = np.tile(1 / WEIGHTS.sum(axis=1), len(star.faces))
    return Rays(zeros, np.where(directions == 0, zeros, directions), t, star.faces[:, MET].reshape(n, 3))


def rays_from_elsewhere(star: Star, count: int) -> Rays:
    """Up to `count` rays between whole points in and around the surface: against all triangles, in whole numbers."""
    rng, size = np.random.default_rng(9), int(np.abs(star.vertices).max())
    origins, targets = rng.integers(-2 * size, 2 * size, (2, count, 3))
    origins[::2] //= 16
    t, least, cosine = meet_planes(star, origins, targets - origins)
    far = (least < -CLEAR) | (t < -CLEAR)
    clear = np.all(far | (least > CLEAR) & (t > CLEAR) & (np.abs(cosine) > CLEAR), axis=1)
    t = np.where(far, np.inf, t)[clear]
    first = t.argmin(axis=1)
    nearest = t[np.arange(len(t)), first]
    corners = np.where(np.isfinite(nearest)[:, None], star.faces[first], -1)
    directions = (targets - origins)[clear]
    return Rays(origins[clear].astype(np.float64), directions.astype(np.float64), nearest, corners)


def meet_planes(star: Star, origins: Integers, directions: Integers) -> tuple[Doubles, Doubles, Doubles]:
    """(n, m) each: t where rays meet the triangles' planes, the least barycentric coordinate there, and the cosine.

    All are quotients of whole numbers below 2^53, which are exact.
    """
    p0, p1, p2 = star.vertices[star.faces].transpose(1, 0, 2)
    normals = np.cross(p1 - p0, p2 - p0)
    facing = directions @ normals.T
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (np.sum(normals * p0, axis=1) - origins @ normals.T) / facing
        moments = np.cross(origins, directions)
        least = np.full(t.shape, np.inf)
        for a, b in ((p0, p1), (p1, p2), (p2, p0)):       # by the volume that the ray spans with the opposite edge
            volume = directions @ np.cross(a, b).T + moments @ (b - a).T
            least = np.minimum(least, volume / facing)
    lengths = np.linalg.norm(directions, axis=1)[:, None] * np.linalg.norm(normals, axis=1)
    return t, least, facing / lengths
