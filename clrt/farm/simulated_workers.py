"""Simulated workers without a device, each with a fixed speed, to measure a farm's overhead on one machine.

    python -m clrt.farm.simulated_workers SCHEDULER COUNT

runs COUNT workers in one process until it is ended. They sleep as long as a device would work, and send and receive
pixels of real size.
"""

from __future__ import annotations

import asyncio
import sys
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..rendering.compile.film_record import film_pixel
from ..rendering.film.tiles import TILE_PIXELS
from .orders import Order

PROOF_TILES = 16


class Simulation:
    """Replacement of a `ShareRenderer`."""

    selectors = None

    def __init__(self, order: Order) -> None:
        assert order.simulated is not None
        self._speed, self._pixel = order.simulated, film_pixel(order.scene, order.choices)

    def share(self, tiles: NDArray[np.uint32], first: int, more: int, pixels: NDArray[Any] | None) -> NDArray[Any]:
        """Return the pixels with `more` more samples, all black, after the time that those would take."""
        start = time.perf_counter()
        film = np.zeros((len(tiles), TILE_PIXELS), self._pixel) if pixels is None else np.array(pixels)
        film["count"] += more
        time.sleep(max(0.0, film.size * more / self._speed - (time.perf_counter() - start)))
        return film

    def drawn(self, names: tuple[str, ...] | None) -> dict[str, NDArray[Any]]:
        """Return no AOVs."""
        return {}

    def proof(self) -> NDArray[Any]:
        """Return the same pixels on all workers."""
        return np.zeros((PROOF_TILES, TILE_PIXELS), self._pixel)

    def introduction(self) -> dict[str, Any]:
        """Return data on the simulated device."""
        return {name: "simulated" for name in ("name", "platform", "platform_version", "driver")}

    def report(self) -> dict[str, Any]:
        """Return a report without a build."""
        return {"bvh": {}, "kernel": {"features": ["LIGHTS"]}, "peak_device_bytes": 0}


async def _run(address: str, count: int) -> None:
    import dask
    from distributed import Worker

    # By default each profiles its stack a hundred times per second, and polls its machine twice: too much for many in
    # one process.
    dask.config.set({"distributed.worker.profile.enabled": False, "distributed.admin.system-monitor.interval": "60s"})
    workers = [Worker(address, nthreads=1, memory_limit=0, host="127.0.0.1", dashboard=False) for _ in range(count)]
    await asyncio.gather(*workers)
    await asyncio.gather(*(worker.finished() for worker in workers))


if __name__ == "__main__":
    asyncio.run(_run(sys.argv[1], int(sys.argv[2])))
