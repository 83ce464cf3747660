"""Devices that render work together into a film on the host.

A worker that has nothing to do is given a share: some tiles, the pixels of these as they are, and which samples to add.
It gives the pixels back, and they replace those of the film. No tile is in two shares at a time, so each pixel's
samples are added one after another, as on one device, whoever adds them: of devices of one kind the picture is the same
bit for bit, however the work was divided. Devices that round differently differ by that much.

Where a worker fails nothing of its shares has come into the film. It is left out, and others get its shares.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..device.launch import IN_FLIGHT
from ..device.open import Device
from ..errors import DeviceError, KernelError
from .compile import CompiledScene
from .on_device import SceneOnDevice
from .session import FEWEST_TILES
from .tiles import TILE_PIXELS
from .work import Work
from .worker import Share, Worker

#: The smallest share is such a part of what fills a launch.
SMALLEST = 16
PAUSE = 5e-4
_log = logging.getLogger(__name__)


class Team:
    """Renders a scene, compiled for each device. DeviceError, or the last one's KernelError, where none is left.

    launch: see `session.first_launch`; tiles: the most that a film will have; before: see `SceneOnDevice`.
    """

    def __init__(self, devices: Sequence[Device], compiled: Sequence[CompiledScene], launches: Sequence[NDArray[Any]],
                 tiles: int, before: Sequence[SceneOnDevice] = ()) -> None:
        self.workers: list[Worker] = []
        self.lost: list[Worker] = []
        for device, scene, launch in zip(devices, compiled, launches):
            try:
                self.workers.append(Worker(device, scene, launch, tiles, before))
            except (DeviceError, KernelError) as error:
                if len(devices) == 1:
                    raise
                _log.warning("%s is left out: %s", device.info.name, error)
                failure = error
        if not self.workers:
            raise failure

    @property
    def everyone(self) -> list[Worker]:
        """Its workers, also those that were left out."""
        return [*self.workers, *self.lost]

    def shares(self) -> list[dict[str, Any]]:
        """What each device did, for the report."""
        return [{"device": worker.name, "platform": worker.scene.device.info.platform, "samples": worker.samples,
                 "longest_launch_seconds": worker.launches.longest, "lost": worker in self.lost}
                for worker in self.everyone]

    @property
    def at(self) -> list[Share]:
        """What it is at."""
        return [share for worker in self.workers for share in worker.at]

    def run(self, work: Work, film: NDArray[Any], numbers: NDArray[np.uint32]) -> Iterator[None]:
        """Renders what is in hand into the film (tiles, TILE_PIXELS), whose tiles have these numbers in the picture;
        yields from time to time. If it is left before its end, `drain` must follow, or the same once more."""
        while work.parts or self.at:
            for worker in [*self.workers] * IN_FLIGHT:
                self._feed(worker, work, film, numbers)
            if self._collect(work, film):
                yield
            else:
                time.sleep(PAUSE)
        work.settle()

    def drain(self, work: Work, film: NDArray[Any]) -> None:
        """Waits for the launches in flight, and for none that is still in hand."""
        while self.at:
            if not self._collect(work, film):
                time.sleep(PAUSE)

    def _feed(self, worker: Worker, work: Work, film: NDArray[Any], numbers: NDArray[np.uint32]) -> None:
        """Gives a worker that has too little in flight a share, smaller near the end, so that all end together."""
        if worker in self.lost or worker.launches.full:
            return
        size = worker.launches.size / TILE_PIXELS
        fair = work.left * worker.launches.size / sum(other.launches.size for other in self.workers) / 2
        busy = [share.part for share in self.at]
        part = work.cut(int(min(size, max(fair, size / SMALLEST))), FEWEST_TILES, worker.window_tiles,
                        worker.scene.most_samples, busy)
        if part is None:
            return
        rows = work.tiles[part.first:part.end]
        try:
            worker.begin(Share(part, rows, numbers[rows], film[rows]))
        except DeviceError as error:
            work.give_back(part)
            self._leave_out(worker, work, error)

    def _collect(self, work: Work, film: NDArray[Any]) -> int:
        """Takes what has been rendered into the film, and tells how many shares that were."""
        count = 0
        for worker in list(self.workers):
            try:
                while share := worker.ended():
                    film[share.rows] = share.pixels
                    count += 1
                if worker.at and worker.launches.idle:    # Ctrl-C came between a launch and the note of its share
                    self._take_back(worker, work)
                    worker.at.clear()
            except DeviceError as error:
                self._leave_out(worker, work, error)
        return count

    def _leave_out(self, worker: Worker, work: Work, error: DeviceError) -> None:
        """Has others do what it was at; it is kept, as giving it up might wait for it."""
        self.workers.remove(worker)
        self.lost.append(worker)
        self._take_back(worker, work)
        if not self.workers:
            raise error
        _log.warning("%s is left out: %s; the others do its work again", worker.name, error)

    def _take_back(self, worker: Worker, work: Work) -> None:
        """What it is at is in hand again; nothing of that has come into the film."""
        for share in reversed(worker.at):
            work.give_back(share.part)
