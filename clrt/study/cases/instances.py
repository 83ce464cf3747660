"""G11: instances by hard transforms are hit like triangles that were transformed in float64."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...instances import InstancedRayQuery
from ..exact import closest_bounds
from ..rays import scattered_rays
from ..row import Row
from ..workloads import Doubles, bumpy_ball
from .subject import Subject

INSTANCES = 12


def measure_instances(subject: Subject, *, quick: bool) -> Iterator[Row]:
    """Hits that float64 rules out, for each kind of transform."""
    count = 1 << (10 if quick else 14)
    vertices, faces = bumpy_ball(1)
    for kind, transforms in transforms_of_kinds().items():
        query = InstancedRayQuery([(vertices, faces)], np.zeros(len(transforms), np.int32), transforms,
                                  device=subject.device, layout=subject.layout, triangle=subject.triangle)
        baked = transforms[:, None, :, 3] + np.einsum("kij,nj->kni", transforms[..., :3], vertices.astype(np.float64))
        first = len(vertices) * np.arange(len(transforms))[:, None, None]
        world = baked.reshape(-1, 3), (faces + first).reshape(-1, 3)
        rays = scattered_rays(world[0].astype(np.float32), count)
        hits = query.closest_hit(*rays)
        hits["primitive"] += np.where(hits["primitive"] >= 0, len(faces) * hits["instance"], 0)
        wrong = closest_bounds(*world, rays).wrong(rays, hits)
        yield Row("G11", f"{INSTANCES} instances, {kind}", count, int(np.count_nonzero(wrong)))


def transforms_of_kinds() -> dict[str, Doubles]:
    """(INSTANCES, 3, 4) of each kind, as float32 holds them."""
    rng = np.random.default_rng(0)
    turns = np.linalg.qr(rng.normal(size=(INSTANCES, 3, 3)))[0]
    moves = rng.uniform(-8, 8, (INSTANCES, 3, 1))
    stretch = 10 ** rng.uniform(-1, 1, (INSTANCES, 1, 3))
    flat = np.where(np.arange(3) == 1, 1e-3, 1.0)
    kinds = {"turned": turns, "stretched": turns * stretch, "mirrored": turns * [-1, 1, 1],
             "nearly flat": turns * flat, "far away": turns}
    far = {"far away": 1e4 + moves}
    return {kind: np.concatenate([linear, far.get(kind, moves)], axis=2).astype(np.float32).astype(np.float64)
            for kind, linear in kinds.items()}
