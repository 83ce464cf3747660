"""BVH builds by number of triangles and builder."""

from __future__ import annotations

import time
from collections.abc import Iterator
from functools import lru_cache, partial
from statistics import median

import numpy as np

from ...accel.build import DEVICE_BUILDERS, build_tree
from ...accel.builders import BUILDERS
from ...accel.traversal_kernels import BUILDER_NAMES
from ...device.launches.device_arrays import lent
from ...device.open import Device, open_device
from ...scene.geometry.scaling import unit_for
from ..rays.ray_speed import Floats
from ..rays.resize import resized
from ..rays.workloads import bumpy_ball, closed_room
from .request import Item, Request, Row

SIZES, QUICK_SIZES = (10_000, 100_000, 1_000_000, 3_000_000, 10_000_000), (300,)
#: Most triangles for the builders in numpy, which do not depend on the device.
MOST_IN_NUMPY = 100_000
#: Maximum builds after the first one, and seconds after which no further one begins.
ROUNDS, SECONDS = 5, 2.0


def items(request: Request) -> Iterator[Item]:
    """Yield each size with each builder."""
    for size in QUICK_SIZES if request.quick else SIZES:
        for name in BUILDER_NAMES:
            if name not in BUILDERS or size <= MOST_IN_NUMPY:
                yield Item(f"{size:,} triangles, {name}", partial(_build, request.device, name, size))


@lru_cache(1)
def _triangles(size: int) -> Floats:
    """Return (n, 3, 3): a bumpy sphere in a room, with a little more than this number of triangles."""
    vertices, faces = closed_room(*resized(*bumpy_ball(), size))
    triangles = vertices[faces]
    triangles *= np.float32(unit_for(float(np.abs(triangles).max())))
    return triangles


def _build(selector: str, name: str, size: int) -> Row:
    device, triangles = open_device(selector), _triangles(size)
    start = time.perf_counter()
    tree = build_tree(device, device.layout, name, triangles)
    first, taken = time.perf_counter() - start, list[float]()
    while len(taken) < ROUNDS and sum(taken) < SECONDS:
        taken.append(build_tree(device, device.layout, name, triangles).build_seconds)
    copied = _upload_seconds(device, triangles) if name in DEVICE_BUILDERS else 0.0
    return {
        "builder": name,
        "triangles": len(triangles),
        "layout": device.layout,
        "seconds": median(taken),
        "first_seconds": first,
        "mtriangles": 1e-6 * len(triangles) / median(taken),
        "upload_seconds": copied,
        "mtriangles_uploaded": 1e-6 * len(triangles) / (median(taken) - copied),
        "sah_cost": tree.sah_cost,
        "bytes_per_triangle": tree.bytes / len(triangles),
        "peak_bytes_per_triangle": tree.peak_bytes / len(triangles) or None,
    }


def _upload_seconds(device: Device, triangles: Floats) -> float:
    """Return the median time to copy the triangles to the device; a CPU reads them where they are."""
    taken = []
    for _ in range(ROUNDS):
        start = time.perf_counter()
        buffer = lent(device, triangles)
        device.queue.finish()
        taken.append(time.perf_counter() - start)
        buffer.release()
    return median(taken)
