"""Accumulation with the film on the host: on several devices, or on one that has no room for the film."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from ...device.memory_plan import check_host
from ...device.open import Device
from ...errors import NoRoomError
from ..compile.compile_scene import CompiledScene
from ..film.film import Film
from ..film.tiles import TILE_PIXELS, row_by_row, tile_by_tile, tiles_of
from .checked_loops import check_samples
from .device_pool import DevicePool
from .device_worker import DeviceWorker
from .launch_plan import LaunchPlan
from .local import LocalAccumulation
from .scene_on_device import SceneOnDevice
from .single_device import SingleDeviceAccumulation
from .work_queue import WorkQueue

#: Approximate number of launches per pass and device: at the end of a pass some devices wait for others.
PASS_LAUNCHES = 12


class MultiDeviceAccumulation(LocalAccumulation):
    """Accumulation of the image of a pool's scene, or of a band of it: then `size` is the band's, as wide as the image,
    and `first_tile` is its first tile."""

    def __init__(self, pool: DevicePool, size: tuple[int, int], first_tile: int = 0) -> None:
        super().__init__(size)
        self.pool, self.first_tile = pool, first_tile
        tiles, pixel = self.work.samples.size, self.compiled.pixel
        check_host(tiles * TILE_PIXELS * pixel.itemsize, *size)
        self._film = np.zeros((tiles, TILE_PIXELS), pixel)
        self._numbers = np.arange(first_tile, first_tile + tiles, dtype=np.uint32)

    @property
    def workers(self) -> list[DeviceWorker]:
        """Workers that are still in use."""
        return self.pool.workers

    @property
    def scene(self) -> SceneOnDevice:
        """The scene on the first device that is still in use."""
        return self.workers[0].scene

    @property
    def scenes(self) -> list[SceneOnDevice]:
        """The scene on every device that is still in use."""
        return [worker.scene for worker in self.workers]

    def shares(self) -> list[dict[str, Any]]:
        """Return what each device rendered, for the report."""
        return self.pool.shares()

    @property
    def longest_launch(self) -> float:
        """Duration of the longest launch in seconds, including its transfers."""
        return max(worker.launches.longest for worker in self.pool.everyone)

    @property
    def _busy(self) -> bool:
        return bool(self.work.parts or self.pool.at)

    def _work(self) -> Iterator[None]:
        return self.pool.run(self.work, self._film, self._numbers)

    def _clear(self) -> None:
        self._film.fill(0)

    def wait(self) -> None:
        """Wait for the launches in flight, without starting pending work."""
        with self._tearing():
            self.pool.drain(self.work, self._film)
            self._settle()

    def pass_limit(self) -> int:
        """Return the samples per pixel that keep all devices busy for some launches."""
        work = sum(worker.launches.size for worker in self.workers)
        return max(1, PASS_LAUNCHES * work // (self.size[0] * self.size[1]))

    def film(self) -> Film:
        """Return the current film; waits for the launches in flight."""
        self.wait()
        film = Film(row_by_row(self._film, self.size), self.backdrop)
        for worker in self.workers:
            check_samples(worker.scene.device, film, self.work, self.size)
        return film

    def restore(self, film: Film, work: WorkQueue) -> None:
        """Resume from a film of this size and the work that produced it."""
        self.work, self._film = work, tile_by_tile(film.pixels)


def make_pool(
    devices: Sequence[Device], compiled: Sequence[CompiledScene], plan: LaunchPlan, before: Sequence[SceneOnDevice] = ()
) -> DevicePool:
    """Return a pool for the planned image; before: see `SceneOnDevice`."""
    rows, columns = tiles_of(plan.size)
    return DevicePool(devices, compiled, [plan.record(scene) for scene in compiled], rows * columns, before)


def make_picture(
    devices: Sequence[Device], compiled: Sequence[CompiledScene], plan: LaunchPlan, before: Sequence[SceneOnDevice] = ()
) -> LocalAccumulation:
    """Return that of a single device if it has room for the film, else that of a pool; before: see `SceneOnDevice`."""
    if len(devices) == 1:
        with suppress(NoRoomError):
            return SingleDeviceAccumulation(devices[0], compiled[0], plan, before)
    return MultiDeviceAccumulation(make_pool(devices, compiled, plan, before), plan.size)
