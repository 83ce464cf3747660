"""Overhead of calls from Python, from a single ray to a million: kernels alone, and with the copies of all arrays."""

from __future__ import annotations

import time
from collections.abc import Iterator
from functools import partial
from statistics import median

from ...queries.mesh import RayQuery
from ..rays.ray_speed import Rays, scattered_rays
from ..rays.workloads import bumpy_ball
from .request import Item, Request, Row

COUNTS, QUICK_COUNTS = [1 << power for power in (0, 6, 10, 14, 17, 20)], [1, 4]
SUBDIVISIONS = 3
#: Seconds of calls of one size, the least number of calls, and calls before them, in which launches grow.
SECONDS, FEWEST, WARM_UP = 0.3, 5, 3


def items(request: Request) -> Iterator[Item]:
    """Yield numbers of rays."""
    vertices, faces = bumpy_ball(SUBDIVISIONS)
    query = RayQuery(vertices, faces, device=request.device)
    for count in QUICK_COUNTS if request.quick else COUNTS:
        yield Item(f"{count:,} rays", partial(_call, query, scattered_rays(vertices, count)))


def _call(query: RayQuery, rays: Rays) -> Row:
    for _ in range(WARM_UP):
        query.closest_hit(*rays)
    kernel, end, taken = query.kernel_seconds, time.perf_counter() + SECONDS, list[float]()
    while len(taken) < FEWEST or time.perf_counter() < end:
        start = time.perf_counter()
        query.closest_hit(*rays)
        taken.append(time.perf_counter() - start)
    return {
        "rays": len(rays[2]),
        "call_seconds": median(taken),
        "kernel_seconds": (query.kernel_seconds - kernel) / len(taken),
    }
