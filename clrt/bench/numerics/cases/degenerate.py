"""G8 and G12: degenerate meshes that are hard for BVH builders, and invalid coordinates and indices."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ....errors import SceneError
from ...rays.hard_meshes import soup
from ...rays.ray_speed import scattered_rays
from ...rays.workloads import Mesh, bumpy_ball
from ..exact_hits import closest_bounds
from ..row import Row
from .subject import Subject

MANY, COPIES = 10_000, 64


def measure_degenerate(subject: Subject, *, quick: bool) -> Iterator[Row]:
    """Count the hits that float64 rules out and report the BVH's stack size; then count invalid meshes not refused."""
    count = 1 << (9 if quick else 13)
    for name, mesh in meshes().items():
        rays = scattered_rays(mesh[0] if len(mesh[1]) else bumpy_ball(0)[0], count)
        for builder in (None, "midpoint"):
            query = subject.query(mesh, builder=builder)
            wrong = closest_bounds(*mesh, rays).wrong(rays, query.closest_hit(*rays))
            yield Row(
                "G8",
                f"{name}, {len(mesh[1])} triangles, {builder or 'default'} BVH",
                count,
                int(np.count_nonzero(wrong)),
                query.tree.stack,
                "entries",
            )
    refused = [_is_refused(subject, mesh) for mesh in no_meshes().values()]
    yield Row("G12", f"refused: {', '.join(no_meshes())}", len(refused), refused.count(False))


def meshes() -> dict[str, Mesh]:
    """Return meshes that are valid but degenerate or extreme, by name."""
    rng = np.random.default_rng(0)
    corners, few = rng.random((60, 3, 3)), rng.random((1, 3, 3))
    around = rng.normal(size=(MANY, 1, 3))
    centered = 0.3 * np.concatenate([around, np.roll(around, 1, axis=0)], axis=1)
    centered = np.concatenate([centered, -centered.sum(axis=1, keepdims=True)], axis=1)
    ball = bumpy_ball(2)
    return {
        "no triangle": loose(few[:0]),
        "one triangle": loose(few),
        "points": loose(np.repeat(corners[:, :1], 3, axis=1)),
        "needles": loose(corners[:, [0, 1, 1]]),
        "copies": loose(np.repeat(corners, COPIES, axis=0)),
        "one centroid": loose(centered),
        "soup": soup(600),
        "a far vertex that no face uses": (np.concatenate([ball[0], [[1e6, 1e6, 1e6]]]).astype(np.float32), ball[1]),
        "teapot in a stadium": loose(np.concatenate([1e-4 * corners, 1e3 * (corners[:12] - 0.5)])),
        "long diagonals": loose(
            np.linspace(0, 1, 500)[:, None, None] * [1, 1, 0] + [[0, 0, 0], [9, 9, 9], [9, 9, 9.1]]
        ),
        "sizes from 1e-15 to 1e15": loose(10 ** np.linspace(-15, 15, 400)[:, None, None] * corners[:1]),
    }


def no_meshes() -> dict[str, Mesh]:
    """Return invalid meshes by name."""
    vertices, faces = bumpy_ball(0)
    bad = {"NaN": np.nan, "infinity": np.inf}
    return {
        **{name: (_with(vertices, value), faces) for name, value in bad.items()},
        "an index past the end": (vertices, _with(faces, len(vertices))),
        "a negative index": (vertices, _with(faces, -1)),
    }


def loose(corners: np.ndarray) -> Mesh:
    """Return a mesh of triangles (m, 3, 3) that share no vertices."""
    return corners.reshape(-1, 3).astype(np.float32), np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3)


def _with(array: np.ndarray, value: float) -> np.ndarray:
    changed = array.copy()
    changed[1, 1] = value
    return changed


def _is_refused(subject: Subject, mesh: Mesh) -> bool:
    try:
        subject.query(mesh)
    except SceneError:
        return True
    return False
