"""G5: accuracy of t for near, far and grazing hits, against the plane equation in float64."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ...rays.workloads import Doubles
from ..exact_hits import closest_bounds
from ..row import Row
from .subject import Subject, endless, ulps, unit_vectors

DISTANCES = (1e-3, 1e-1, 1e1, 1e3, 1e5, 1e7)
ANGLES_DEGREES = (0.0, 60.0, 85.0, 89.0, 89.9, 89.999)
#: Smallest triangle size relative to its distance: float32 directions cannot aim accurately enough at smaller ones.
SMALLEST = 1e-4
#: Fewest hits that are evaluated: cases with fewer, far away at grazing angles, are skipped.
FEWEST = 100


def measure_distances(subject: Subject, *, quick: bool) -> Iterator[Row]:
    """Measure for each distance and angle the lost hits, and the largest error of t and its 99.9 % quantile."""
    count = 1 << (12 if quick else 17)
    for distance in DISTANCES:
        for angle in ANGLES_DEGREES:
            t, exact, sure = distances(subject, distance, angle, count)
            found = np.isfinite(t)
            if np.count_nonzero(found) < FEWEST:
                continue
            lost, errors = int(np.count_nonzero(sure & ~found)), ulps(t[found], exact[found])
            where = f"from {distance:g} away at {angle:g} degrees"
            yield Row("G5", f"t {where}, largest", len(t), lost, float(errors.max()), "ulp")
            yield Row("G5", f"t {where}, 99.9 %", len(t), lost, float(np.quantile(errors, 0.999)), "ulp")


def distances(
    subject: Subject, distance: float, angle_degrees: float, count: int
) -> tuple[NDArray[np.float32], Doubles, NDArray[np.bool_]]:
    """Return computed t, exact t, and whether there must be a hit, for `count` rays of unit direction at a triangle.

    angle_degrees: between the rays and the triangle's normal. exact: by the plane equation.
    """
    rng = np.random.default_rng(0)
    normal, side = unit_vectors(rng, 2)
    side -= (side @ normal) * normal
    side /= np.linalg.norm(side)
    frame = np.stack([side, np.cross(normal, side)])
    size = max(1.0, SMALLEST * distance)
    corners = (size * np.array([[-1, -1], [2, -1], [-1, 2]]) @ frame).astype(np.float32)
    p = corners.astype(np.float64)
    turn, slope = rng.uniform(0, 2 * np.pi, count), np.radians(angle_degrees)
    away = np.cos(slope) * normal + np.sin(slope) * np.stack([np.cos(turn), np.sin(turn)], axis=1) @ frame
    rays = endless(rng.dirichlet([2, 2, 2], count) @ p + distance * away, -away)
    mesh = corners, np.array([[0, 1, 2]], np.int32)
    origins, directions = (array.astype(np.float64) for array in rays[:2])
    plane = np.cross(p[1] - p[0], p[2] - p[0])
    exact = ((p[0] - origins) @ plane) / (directions @ plane)
    return subject.query(mesh).closest_hit(*rays)["t"], exact, closest_bounds(*mesh, rays).primitive == 0
