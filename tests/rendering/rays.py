"""Brute-force ray–triangle and ray–sphere intersection in float64, and test shapes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]
Integers = NDArray[np.int64]

GOLDEN = (1 + 5**0.5) / 2


def icosphere(subdivisions: int) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Return vertices (n, 3) and faces (20·4^subdivisions, 3) of a closed unit icosphere with shared vertices."""
    vertices = np.array([p for a in (-1, 1) for b in (-GOLDEN, GOLDEN) for p in ((0, a, b), (a, b, 0), (b, 0, a))])
    i, j, k = np.array([(i, j, k) for i in range(12) for j in range(i) for k in range(j)]).T
    edges = [np.linalg.norm(vertices[a] - vertices[b], axis=1) for a, b in ((i, j), (j, k), (k, i))]
    faces = np.stack([i, j, k], axis=1)[np.all(np.isclose(edges, 2), axis=0)]
    for _ in range(subdivisions):
        sides = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        unique, middle = np.unique(sides, axis=0, return_inverse=True)
        a, b, c = faces.T
        ab, bc, ca = (len(vertices) + middle.reshape(-1, 3)).T
        vertices = np.concatenate([vertices, vertices[unique].mean(axis=1)])
        vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
        parts = (a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)
        faces = np.concatenate([np.stack(part, axis=1) for part in parts])
    return (vertices / np.linalg.norm(vertices, axis=1, keepdims=True)).astype(np.float32), faces.astype(np.int32)


def grid(side: int) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Return 2·side² triangles that fill the square [0, side]² of the plane y = 0, with integer coordinates."""
    z, x = np.divmod(np.arange((side + 1) ** 2), side + 1)
    corner = (np.arange(side)[:, None] * (side + 1) + np.arange(side)).ravel()[:, None]
    faces = np.concatenate([corner + [0, side + 1, side + 2], corner + [0, side + 2, 1]])
    return np.column_stack([x, 0 * x, z]).astype(np.float32), faces.astype(np.int32)


def hit_triangles(corners: Doubles, origin: Doubles, direction: Doubles) -> tuple[Doubles, Integers, Doubles]:
    """Return (n,) t of the closest hit among triangles (m, 3, 3), inf for a miss; its index; and the decision's margin.

    Möller–Trumbore. A ray's margin is the least relative distance, over all relevant triangles, of a
    barycentric coordinate from an edge, and of the next t from the closest.
    """
    p0, e1, e2 = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    q = np.cross(direction[:, None], e2)
    s = origin[:, None] - p0
    r = np.cross(s, e1)
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = 1 / np.sum(q * e1, axis=2)
        t, u, v = (np.sum(x * y, axis=2) * inverse for x, y in ((r, e2), (q, s), (r, direction[:, None])))
    least = np.minimum(np.minimum(u, v), 1 - u - v)
    t_hit = np.where((least >= 0) & (t > 0), t, np.inf)
    closest = t_hit.min(axis=1)
    matters = (t > 0) & (t <= closest[:, None] * 1.001)
    margin = np.minimum(np.where(matters, np.abs(least), np.inf).min(axis=1), _gap(t_hit))
    return closest, t_hit.argmin(axis=1), margin


def hit_spheres(spheres: Doubles, origin: Doubles, direction: Doubles) -> tuple[Doubles, Integers, Doubles]:
    """Intersect spheres (m, 4), centre and radius, like `hit_triangles`; the margin is the
    discriminant's distance from 0.
    """
    f = origin[:, None] - spheres[:, :3]
    a, b = np.sum(direction**2, axis=1)[:, None], np.sum(f * direction[:, None], axis=2)
    beside = f - (b / a)[..., None] * direction[:, None]
    discriminant = 1 - np.sum(beside**2, axis=2) / spheres[:, 3] ** 2
    root = np.sqrt(np.maximum(discriminant, 0)) * spheres[:, 3] * np.sqrt(a)
    t = np.where(-b - root > 0, -b - root, -b + root) / a
    t_hit = np.where((discriminant >= 0) & (t > 0), t, np.inf)
    return t_hit.min(axis=1), t_hit.argmin(axis=1), np.minimum(np.abs(discriminant).min(axis=1), _gap(t_hit))


def _gap(t_hit: Doubles) -> Doubles:
    """Return the relative distance from the first to the second hit; inf if there are fewer than two."""
    first, second = np.sort(t_hit, axis=1)[:, :2].T
    return np.asarray(np.divide(second, first, out=np.full(len(first), np.inf), where=np.isfinite(second)) - 1)
