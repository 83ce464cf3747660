"""G3: tiny and huge meshes have the hits of float64, and a tiny mesh in a large scene stays watertight."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...rays.hard_meshes import icosphere
from ...rays.ray_speed import scattered_rays
from ...rays.workloads import Mesh, bumpy_ball, closed_room
from ..aimed_rays import inside_rays
from ..exact_hits import closest_bounds
from ..row import Row
from .subject import Subject, endless, unit_vectors

FACTORS = (1e-20, 1e-10, 1e10, 1e15)
#: Radius and subdivisions of the tiny sphere mesh in a room of size 1; its edges are 1e-7 long.
TINY_RADIUS, TINY_SUBDIVISIONS = 5e-6, 6


def measure_scales(subject: Subject, *, quick: bool) -> Iterator[Row]:
    """Count the hits that float64 rules out, rays that escape the tiny mesh, and rays at its center that miss it."""
    mesh, count = bumpy_ball(2), 1 << (12 if quick else 17)
    for factor in FACTORS:
        points = (mesh[0].astype(np.float64) * factor).astype(np.float32)
        origins, directions, t_max = scattered_rays(mesh[0], count)
        rays = (origins.astype(np.float64) * factor).astype(np.float32), directions, t_max
        wrong = closest_bounds(points, mesh[1], rays).wrong(rays, subject.query((points, mesh[1])).closest_hit(*rays))
        yield Row("G3", f"a mesh times {factor:g}", count, int(np.count_nonzero(wrong)))
    ball, faces = tiny_ball_in_room()
    query, rng = subject.query((ball, faces)), np.random.default_rng(0)
    triangles = len(faces) - 12
    inside = inside_rays(ball[: ball.shape[0] - 8], faces[:triangles], count, rng)
    yield Row(
        "G3",
        "from inside a sphere with edges of 1e-7 of the scene",
        count,
        int(np.count_nonzero(~_on(query.closest_hit(*inside)["primitive"], triangles))),
    )
    center, towards = ball[:-8].astype(np.float64).mean(axis=0), unit_vectors(rng, count)
    hits = query.closest_hit(*endless(center - 0.4 * towards, towards))
    yield Row(
        "G3", "from afar at the center of that sphere", count, int(np.count_nonzero(~_on(hits["primitive"], triangles)))
    )


def tiny_ball_in_room() -> Mesh:
    """Return a tiny sphere mesh off the center of a unit cube, followed by the cube's 8 vertices and 12 triangles."""
    ball, faces = icosphere(TINY_SUBDIVISIONS)
    points = (ball * TINY_RADIUS + [0.03, -0.02, 0.05]).astype(np.float32)
    ends = np.array([[-1, 0, 0], [1, 0, 0]], np.float32) / np.float32(6)
    cube, sides = closed_room(ends, np.zeros((0, 3), np.int32))
    return np.concatenate([points, cube[2:]]), np.concatenate([faces, sides + np.int32(len(points) - 2)])


def _on(primitive: NDArray[Any], triangles: int) -> NDArray[np.bool_]:
    return np.asarray((primitive >= 0) & (primitive < triangles))
