"""G1: no ray escapes from a closed mesh, wherever the mesh is and however large it is.

Rays start inside and are aimed, in float32, at vertices and at points on edges and faces. Far from the origin
vertices coincide, but neighbors still share them, so the mesh stays closed.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...rays.hard_meshes import icosphere
from ...rays.workloads import Mesh, bumpy_ball
from ..aimed_rays import inside_rays
from ..row import Row
from .subject import Subject

#: (Translation in mesh sizes, scale factor).
PLACES = ((0, 1), (1e3, 1), (1e4, 1), (1e5, 1), (1e6, 1), (0, 1e-6), (0, 1e6))
AWAY = np.array([1.0, -0.7, 0.4])
RAYS = 1 << 20


def measure_watertight(subject: Subject, *, quick: bool, rays: float = 1e8) -> Iterator[Row]:
    """Count the escaped rays for each mesh and place, with `rays` rays in total, or 2e6 if `quick`."""
    meshes = {"icosphere": icosphere(4 if quick else 8), "bumpy ball": bumpy_ball(4 if quick else 7)}
    rays = 2e6 if quick else rays
    for name, mesh in meshes.items():
        for sizes, factor in PLACES:
            count = round(rays / (len(meshes) * len(PLACES)))
            yield Row(
                "G1",
                f"{name}, {len(mesh[1])} triangles, {words(sizes, factor)}",
                count,
                misses(subject, placed(mesh, sizes, factor), count),
            )


def placed(mesh: Mesh, sizes: float, factor: float) -> Mesh:
    """Move the mesh by `sizes` of its sizes along AWAY, then scale it; rounded to float32."""
    points = mesh[0].astype(np.float64)
    points = factor * (points + sizes * np.ptp(points, axis=0).max() * AWAY)
    return points.astype(np.float32), mesh[1]


def misses(subject: Subject, mesh: Mesh, count: int) -> int:
    """Return how many of `count` rays from inside the closed mesh miss it."""
    query, rng, missed = subject.query(mesh), np.random.default_rng(0), 0
    for first in range(0, count, RAYS):
        rays = inside_rays(*mesh, min(RAYS, count - first), rng)
        missed += int(np.count_nonzero(query.closest_hit(*rays)["primitive"] < 0))
    return missed


def words(sizes: float, factor: float) -> str:
    """Describe a scene's scale factor and its translation in scene sizes."""
    return f"moved by {sizes:g} sizes" if sizes else f"times {factor:g}" if factor != 1 else "in its place"
