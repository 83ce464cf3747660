"""Scheduler for several devices that render into one film on the host.

An idle worker gets a share: some tiles, their current pixels, and which samples to add. It returns the pixels, which
replace those of the film. A tile is never in two shares at a time, so each pixel's samples are added one after another,
as on a single device, whichever device adds them: on devices of one kind the image is the same bit for bit, however the
work was divided. Devices that round differently differ by that much.

If a worker fails, nothing of its unfinished shares has entered the film. It is removed, and others take over its
shares.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...device.launches.launch import IN_FLIGHT
from ...device.open import Device
from ...errors import DeviceError, KernelError
from ..compile.compile_scene import CompiledScene
from ..film.tiles import TILE_PIXELS
from .device_worker import DeviceWorker, WorkerShare
from .launch_plan import FEWEST_TILES
from .scene_on_device import SceneOnDevice
from .work_queue import WorkQueue

#: Divisor that gives the smallest share from the size of a full launch.
SMALLEST = 16
PAUSE = 5e-4
_log = logging.getLogger(__name__)


class DevicePool:
    """Workers for a scene compiled for each device. Raises DeviceError, or the last one's KernelError, if none is left.

    launches: see `LaunchPlan.record`; tiles: maximum number of tiles of a film; before: see `SceneOnDevice`.
    """

    def __init__(
        self,
        devices: Sequence[Device],
        compiled: Sequence[CompiledScene],
        launches: Sequence[NDArray[Any]],
        tiles: int,
        before: Sequence[SceneOnDevice] = (),
    ) -> None:
        self.workers: list[DeviceWorker] = []
        self.lost: list[DeviceWorker] = []
        for device, scene, launch in zip(devices, compiled, launches):
            try:
                self.workers.append(DeviceWorker(device, scene, launch, tiles, before))
            except (DeviceError, KernelError) as error:
                if len(devices) == 1:
                    raise
                _log.warning("%s is excluded: %s", device.info.name, error)
                failure = error
        if not self.workers:
            raise failure

    @property
    def everyone(self) -> list[DeviceWorker]:
        """All workers, including those that were removed."""
        return [*self.workers, *self.lost]

    def shares(self) -> list[dict[str, Any]]:
        """Return what each device rendered, for the report."""
        return [
            {
                "device": worker.name,
                "platform": worker.scene.device.info.platform,
                "samples": worker.samples,
                "longest_launch_seconds": worker.launches.longest,
                "lost": worker in self.lost,
            }
            for worker in self.everyone
        ]

    @property
    def at(self) -> list[WorkerShare]:
        """Shares in flight."""
        return [share for worker in self.workers for share in worker.at]

    def run(self, work: WorkQueue, film: NDArray[Any], numbers: NDArray[np.uint32]) -> Iterator[None]:
        """Render the pending work into the film (tiles, TILE_PIXELS), whose tiles have these numbers in the image;
        yield after each collection. If it is left before its end, call `drain`, or `run` again."""
        while work.parts or self.at:
            for worker in [*self.workers] * IN_FLIGHT:
                self._feed(worker, work, film, numbers)
            if self._collect(work, film):
                yield
            else:
                time.sleep(PAUSE)
        work.settle()

    def drain(self, work: WorkQueue, film: NDArray[Any]) -> None:
        """Wait for the launches in flight, without starting pending work."""
        while self.at:
            if not self._collect(work, film):
                time.sleep(PAUSE)

    def _feed(self, worker: DeviceWorker, work: WorkQueue, film: NDArray[Any], numbers: NDArray[np.uint32]) -> None:
        """Give a share to a worker with too little in flight, smaller near the end, so that all finish together."""
        if worker in self.lost or worker.launches.full:
            return
        size = worker.launches.size / TILE_PIXELS
        fair = work.left * worker.launches.size / sum(other.launches.size for other in self.workers) / 2
        busy = [share.part for share in self.at]
        part = work.cut(
            int(min(size, max(fair, size / SMALLEST))),
            FEWEST_TILES,
            worker.window_tiles,
            worker.scene.most_samples,
            busy,
        )
        if part is None:
            return
        rows = work.tiles[part.first : part.end]
        try:
            worker.begin(WorkerShare(part, rows, numbers[rows], film[rows]))
        except DeviceError as error:
            work.give_back(part)
            self._leave_out(worker, work, error)

    def _collect(self, work: WorkQueue, film: NDArray[Any]) -> int:
        """Store finished shares in the film, and return their number."""
        count = 0
        for worker in list(self.workers):
            try:
                while share := worker.ended():
                    film[share.rows] = share.pixels
                    count += 1
                if worker.at and worker.launches.idle:  # Ctrl-C came between a launch and the record of its share
                    self._take_back(worker, work)
                    worker.at.clear()
            except DeviceError as error:
                self._leave_out(worker, work, error)
        return count

    def _leave_out(self, worker: DeviceWorker, work: WorkQueue, error: DeviceError) -> None:
        """Remove a worker and return its shares to the others; it stays in `lost`, as releasing it might block."""
        self.workers.remove(worker)
        self.lost.append(worker)
        self._take_back(worker, work)
        if not self.workers:
            raise error
        _log.warning("%s is excluded: %s; the others repeat its work", worker.name, error)

    def _take_back(self, worker: DeviceWorker, work: WorkQueue) -> None:
        """Return a worker's shares in flight to the pending work; nothing of them has entered the film."""
        for share in reversed(worker.at):
            work.give_back(share.part)
