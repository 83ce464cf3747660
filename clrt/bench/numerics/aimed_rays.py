"""Rays aimed at hard cases: vertices, edges, planes of boxes. In float32, so that all intersect the same rays."""

from __future__ import annotations

import numpy as np

from ..rays.ray_speed import Floats, Rays, scattered_rays
from ..rays.workloads import Doubles, Faces

#: Extent of the origins of rays at vertices and edges around a mesh's center, relative to its smallest half extent.
INSIDE = 0.3


def rays_of_kinds(vertices: Floats, faces: Faces, count: int, seed: int = 0) -> dict[str, Rays]:
    """Return `count` rays per kind. random: see `scattered_rays`; vertices, edges: from the mesh's center to those.

    axes: parallel to an axis, in both directions and with zeros of both signs, half of them exactly through a vertex.
    """
    rng = np.random.default_rng(seed)
    corners = vertices[faces[rng.integers(0, len(faces), count)]].astype(np.float64)
    along = rng.random((count, 1))
    return {
        "random": scattered_rays(vertices, count, seed),
        "vertices": _from_inside(rng, vertices, corners[:, 0]),
        "edges": _from_inside(rng, vertices, along * corners[:, 0] + (1 - along) * corners[:, 1]),
        "axes": _along_axes(rng, vertices, corners[:, 0]),
    }


def inside_rays(vertices: Floats, faces: Faces, count: int, rng: np.random.Generator) -> Rays:
    """Return `count` rays from the center of a mesh: a third each to vertices, to points on edges and on faces."""
    corners = vertices[faces[rng.integers(0, len(faces), count)]].astype(np.float64)
    weights = rng.dirichlet([1, 1, 1], count)
    weights[: count // 3] = [1, 0, 0]
    edges = weights[count // 3 : 2 * (count // 3)]
    edges[:, 2] = 0
    edges /= edges.sum(axis=1, keepdims=True)
    return _from_inside(rng, vertices, np.einsum("ni,nij->nj", weights, corners))


def _from_inside(rng: np.random.Generator, vertices: Floats, targets: Doubles) -> Rays:
    low, high = vertices.min(axis=0).astype(np.float64), vertices.max(axis=0).astype(np.float64)
    spread = rng.normal(size=targets.shape)
    spread *= rng.random((len(targets), 1)) / np.linalg.norm(spread, axis=1, keepdims=True)
    origins = ((low + high) / 2 + INSIDE * float((high - low).min()) / 2 * spread).astype(np.float32)
    return origins, (targets - origins).astype(np.float32), np.full(len(targets), np.inf, np.float32)


def _along_axes(rng: np.random.Generator, vertices: Floats, targets: Doubles) -> Rays:
    count = len(targets)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    origins = np.where(rng.random((count, 1)) < 0.5, targets, rng.uniform(low, high, (count, 3)))
    axis, rows = rng.integers(0, 3, count), np.arange(count)
    origins[rows, axis] = rng.uniform(low - (high - low), high + (high - low), (count, 3))[rows, axis]
    directions = np.copysign(np.zeros((count, 3)), rng.normal(size=(count, 3)))
    directions[rows, axis] = np.copysign(1, directions[rows, axis])
    return origins.astype(np.float32), directions.astype(np.float32), np.full(count, np.inf, np.float32)


def all_rays(kinds: dict[str, Rays]) -> Rays:
    """Concatenate the rays of all kinds."""
    origins, directions, t_max = (np.concatenate(arrays) for arrays in zip(*kinds.values()))
    return origins, directions, t_max
