"""G6 and G7: axis-parallel rays in the planes of box faces, and a plane of 200 thousand coplanar triangles."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...rays.ray_speed import differing
from ...rays.workloads import Mesh
from ..aimed_rays import rays_of_kinds
from ..exact_hits import closest_bounds
from ..row import Row
from .subject import Subject, endless, ulps

#: Cubes along each side of the lattice, and squares along each side of the plane.
LATTICE, SIDE = 5, 316
HEIGHT = 3.0


def measure_axes(subject: Subject, *, quick: bool) -> Iterator[Row]:
    """Measure axis-parallel rays through cubes at integer positions, half of them in planes of faces; then a plane."""
    mesh, count = lattice(), 1 << (12 if quick else 18)
    rays = rays_of_kinds(*mesh, count)["axes"]
    hits = subject.query(mesh).closest_hit(*rays)
    wrong = closest_bounds(*mesh, rays).wrong(rays, hits)
    yield Row("G6", "along axes through cubes, by float64", count, int(np.count_nonzero(wrong)))
    unlike = differing(subject.query(mesh, layout="list").closest_hit(*rays), hits)
    yield Row("G6", "along axes through cubes, unlike brute force", count, int(np.count_nonzero(unlike)))
    yield from _onto_plane(subject, count)


def _onto_plane(subject: Subject, count: int) -> Iterator[Row]:
    mesh, rng = plane(SIDE), np.random.default_rng(0)
    query = subject.query(mesh)
    corners = mesh[0][rng.integers(0, len(mesh[0]), count)].astype(np.float64)
    targets = {"vertices": corners, "anywhere": rng.uniform(0, SIDE, (count, 3)) * [1, 0, 1]}
    ways = {
        "straight": np.tile([0, -1, 0], (count, 1)).astype(np.float64),
        "aslant": np.column_stack([rng.integers(-2, 3, count), np.full(count, -1), rng.integers(-2, 3, count)]),
    }
    for target, points in targets.items():
        for way, directions in ways.items():
            points = np.round(points * 1024) / 1024
            hits = query.closest_hit(*endless(points - HEIGHT * directions, directions))
            off = ulps(hits["t"], np.full(count, HEIGHT))
            yield Row(
                "G7",
                f"{way} onto a plane of {len(mesh[1])} triangles, {target}",
                count,
                int(np.count_nonzero(hits["primitive"] < 0)),
                float(off[np.isfinite(off)].max(initial=0)),
                "ulp",
            )


def lattice() -> Mesh:
    """Return LATTICE³ unit cubes with integer corners, 1 apart along x and touching along y and z."""
    cells = np.stack(np.unravel_index(np.arange(LATTICE**3), (LATTICE,) * 3), axis=1) * [2, 1, 1]
    cube = np.stack(np.unravel_index(np.arange(8), (2, 2, 2)), axis=1)
    sides = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    faces = np.concatenate([sides[:, [0, 1, 2]], sides[:, [0, 2, 3]]])
    vertices = (cells[:, None] + cube).reshape(-1, 3).astype(np.float32)
    return vertices, (8 * np.arange(len(cells))[:, None, None] + faces).reshape(-1, 3).astype(np.int32)


def plane(side: int) -> Mesh:
    """Return 2·side² triangles with integer vertices that fill the square [0, side]² of the plane y = 0."""
    z, x = np.divmod(np.arange((side + 1) ** 2), side + 1)
    corner = (np.arange(side)[:, None] * (side + 1) + np.arange(side)).ravel()[:, None]
    faces = np.concatenate([corner + [0, side + 1, side + 2], corner + [0, side + 2, 1]])
    return np.column_stack([x, 0 * x, z]).astype(np.float32), faces.astype(np.int32)
