"""G10: tiny distant, huge near, enclosing, tangent and grazed spheres, against extended precision."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...rays.workloads import Doubles
from ..row import Row
from .subject import Subject, endless, ulps, unit_vectors

#: A hit is undecided if the ray passes the silhouette within this fraction of the distance to the center.
OPEN = 2.0**-40
#: Hits are steep, not grazing, if the ray passes the center within this fraction of the radius.
STEEP = 0.9


Extended = NDArray[np.longdouble]


class Case(NamedTuple):
    """One sphere, in float32 numbers, and rays at it. direction: of unit length."""

    what: str
    center: Doubles
    radius: float
    origin: Doubles
    direction: Doubles


def measure_spheres(subject: Subject, *, quick: bool) -> Iterator[Row]:
    """Count false hits and false misses, and measure the largest error of t of all hits and of those that are steep."""
    count = 1 << (12 if quick else 18)
    for case in cases(count):
        table = np.append(case.center, case.radius).astype(np.float32)[None]
        rays = endless(case.origin, case.direction)
        hits = subject.query(spheres=table).closest_hit(*rays)
        t, beside, slack = exact_hits(table[0].astype(np.longdouble), *(a.astype(np.longdouble) for a in rays[:2]))
        decided = np.abs(beside - case.radius) > slack
        wrong = decided & ((hits["primitive"] == 0) != np.isfinite(t))
        yield Row("G10", f"{case.what}: hit or not", int(np.count_nonzero(decided)), int(np.count_nonzero(wrong)))
        both = decided & np.isfinite(t) & (hits["primitive"] == 0)
        for name, some in (("steep", both & (beside < STEEP * case.radius)), ("grazing", both)):
            if some.any():
                errors = ulps(hits["t"][some], t[some].astype(np.float64))
                yield Row(
                    "G10",
                    f"{case.what}: t, {name}, largest",
                    int(np.count_nonzero(some)),
                    0,
                    float(errors.max()),
                    "ulp",
                )


def cases(count: int) -> Iterator[Case]:
    """Yield cases of `count` rays each. Some rays miss the sphere; half of the aimed ones pass near its silhouette."""
    rng, origin = np.random.default_rng(0), np.zeros(3)
    for distance in (1e1, 1e4, 1e5, 1e6):
        center = distance * np.array([0.6, -0.48, 0.64])
        yield _aimed(rng, f"radius 1 from {distance:g}", center, 1.0, np.tile(origin, (count, 1)))
    for radius in (1e5, 1e6, 1e7):
        eye = np.array([0.0, 1.5, 0.0])
        yield _aimed(
            rng,
            f"a ground of radius {radius:g} from 1.5 above",
            np.array([0, -radius, 0]),
            radius,
            np.tile(eye, (count, 1)),
        )
    inside = 0.999 * rng.random((count, 1)) * unit_vectors(rng, count)
    yield Case("from inside", origin, 1.0, inside, unit_vectors(rng, count))


def _aimed(rng: np.random.Generator, what: str, center: Doubles, radius: float, origin: Doubles) -> Case:
    """Aim at points up to 1.1 radii off the center, as seen from the origin; half of them near 1 radius."""
    count = len(origin)
    beside = np.where(
        np.arange(count) % 2,
        1.1 * np.sqrt(rng.random(count)),
        1 + rng.choice([-1, 1], count) * 10 ** rng.uniform(-7, -1, count),
    )
    to_center = center - origin
    distance = np.linalg.norm(to_center, axis=1)
    across = np.cross(to_center, unit_vectors(rng, count))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    sine = np.minimum(beside * radius / distance, 1)[:, None]
    towards = np.sqrt(1 - sine**2) * to_center / distance[:, None] + sine * across
    return Case(what, center, radius, origin, towards)


def exact_hits(sphere: Extended, origin: Extended, direction: Extended) -> tuple[Extended, Extended, Extended]:
    """Return t of the nearest hit at t > 0, or inf; the line's distance from the center; the uncertainty of float32.

    sphere: center and radius; all in extended precision. Computed from the foot of the perpendicular from the center.
    """
    along = direction / np.sqrt(np.sum(direction**2, axis=1, keepdims=True))
    to_center = sphere[:3] - origin
    foot = np.sum(to_center * along, axis=1)
    off = to_center - foot[:, None] * along
    beside = np.sqrt(np.sum(off**2, axis=1))
    half = np.sqrt(np.maximum((sphere[3] - beside) * (sphere[3] + beside), 0))
    near, far = foot - half, foot + half
    t = np.where(near > 0, near, far)
    t = np.where((beside <= sphere[3]) & (t > 0), t, np.inf)
    slack = OPEN * np.sqrt(np.sum(to_center**2, axis=1))
    return t / np.sqrt(np.sum(direction**2, axis=1)), beside, slack
