"""G4: slivers a million times longer than wide, and fans of a hundred triangles around one edge."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...rays.ray_speed import scattered_rays
from ...rays.workloads import Mesh
from ..aimed_rays import inside_rays
from ..exact_hits import closest_bounds
from ..row import Row
from .subject import Subject, endless

BLADES = 100


def measure_slivers(subject: Subject, *, quick: bool) -> Iterator[Row]:
    """Count rays that escape a tube of slivers, hits on a fan that float64 rules out, and rays that miss its edge."""
    count, rng = 1 << (12 if quick else 20), np.random.default_rng(0)
    tube = sliver_tube(64 if quick else 1 << 16)
    hits = subject.query(tube).closest_hit(*inside_rays(*tube, count, rng))
    yield Row("G4", f"from inside a tube with {len(tube[1]) // 2} slivers of 1 : 1e6", count, _none(hits))
    vertices, faces = fan()
    query, rays = subject.query((vertices, faces)), scattered_rays(vertices, count)
    wrong = closest_bounds(vertices, faces, rays).wrong(rays, query.closest_hit(*rays))
    yield Row("G4", f"a fan of {BLADES} triangles at one edge", count, int(np.count_nonzero(wrong)))
    target = np.stack([np.zeros(count), rng.uniform(0.1, 0.9, count), np.zeros(count)], axis=1).astype(np.float32)
    origin = (target + rng.normal(size=(count, 3))).astype(np.float32)
    hits = query.closest_hit(*endless(origin.astype(np.float64), target.astype(np.float64) - origin))
    yield Row("G4", "at the edge of that fan", count, _none(hits))


def sliver_tube(sides: int) -> Mesh:
    """Return a closed prism of radius 1 around z: 2·sides slivers of aspect ratio 1e6, and a fan at each end."""
    turn = 2 * np.pi * np.arange(sides) / sides
    ring = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    half = 1e6 * np.pi / sides
    ends = [np.column_stack([ring, np.full(sides, z)]) for z in (-half, half)]
    vertices = np.concatenate([*ends, [[0, 0, -half], [0, 0, half]]]).astype(np.float32)
    a = np.arange(sides)
    b = (a + 1) % sides
    walls = [(a, b, b + sides), (a, b + sides, a + sides)]
    caps = [(b, a, 0 * a + 2 * sides), (a + sides, b + sides, 0 * a + 2 * sides + 1)]
    return vertices, np.concatenate([np.stack(face, axis=1) for face in (*walls, *caps)]).astype(np.int32)


def fan() -> Mesh:
    """Return triangles around the edge from the origin to (0, 1, 0), like the pages of an open book."""
    turn = np.linspace(0, 2 * np.pi, BLADES, endpoint=False)
    tips = np.stack([np.cos(turn), np.full(BLADES, 0.5), np.sin(turn)], axis=1)
    vertices = np.concatenate([[[0, 0, 0], [0, 1, 0]], tips]).astype(np.float32)
    faces = np.stack([np.zeros(BLADES), np.ones(BLADES), 2 + np.arange(BLADES)], axis=1)
    return vertices, faces.astype(np.int32)


def _none(hits: np.ndarray) -> int:
    return int(np.count_nonzero(hits["primitive"] < 0))
