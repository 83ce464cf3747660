"""A scene on a worker, ready to render shares of its image."""

from __future__ import annotations

from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..rendering.accumulation.launch_plan import LaunchPlan
from ..rendering.accumulation.multi_device import MultiDeviceAccumulation, make_pool
from ..rendering.accumulation.work_queue import WorkPart, WorkQueue
from ..rendering.compile.scene_compiler import SceneCompiler
from ..rendering.film.tiles import TILE_PIXELS, scattered
from ..rendering.guiding.training import guided
from .orders import Order
from .worker_devices import about, opened

#: The devices do one thing at a time.
_at_work = Lock()
#: Number of tiles in a proof.
PROOF_TILES = 16


class ShareRenderer:
    """The order's scene, compiled for this worker's devices. Raises DeviceError, KernelError and NoRoomError."""

    def __init__(self, order: Order) -> None:
        self.scene, self.selectors = order.scene, order.devices
        settings = order.scene.render
        devices = opened(order.devices)
        plan = LaunchPlan.of(settings, order.planned_spp)
        compiled = guided(devices, SceneCompiler(devices).compile(order.scene, order.choices), plan)
        self._pool = make_pool(devices, compiled, plan)
        # Its film uses no memory while it is empty.
        self._picture = MultiDeviceAccumulation(self._pool, settings.size)
        self._pixel = compiled[0].pixel

    def share(self, tiles: NDArray[np.uint32], first: int, more: int, pixels: NDArray[Any] | None) -> NDArray[Any]:
        """See `remote.render_share`."""
        count = len(tiles)
        film = np.zeros((count, TILE_PIXELS), self._pixel) if pixels is None else np.array(pixels)
        work = WorkQueue(np.full((1, count), first, np.int64))
        work.take(np.arange(count), [WorkPart(0, count, first, more)])
        with _at_work:
            for _ in self._pool.run(work, film, tiles):
                pass
        return film

    def proof(self) -> NDArray[Any]:
        """Render one sample of a few tiles from all over the image, to compare with other workers'."""
        tiles = scattered(self._picture.tile_samples.size).astype(np.uint32)
        return self.share(np.sort(tiles[:: max(1, len(tiles) // PROOF_TILES)][:PROOF_TILES]), 0, 1, None)

    def drawn(self, names: tuple[str, ...] | None) -> dict[str, NDArray[Any]]:
        """See `remote.draw`."""
        with _at_work:
            if names is None:
                return {**self._picture.guides()}
            return {**self._picture.first_hits(self.scene, names)}

    def introduction(self) -> dict[str, Any]:
        """Return data on the worker's devices."""
        return about(opened(self.selectors))

    def report(self) -> dict[str, Any]:
        """Return the worker's part of a report."""
        return self._picture.machine(opened(self.selectors))
