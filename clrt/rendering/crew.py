"""A picture rendered by several devices, or by one where its film has no room.

The film lies on the host. A worker that has nothing to do is given a share: some tiles, the pixels of these as they
are, and which samples to add. It gives the pixels back, and they replace those of the film. No tile is in two shares at
a time, so each pixel's samples are added one after another, as on one device, whoever adds them: of devices of one kind
the picture is the same bit for bit, however the work was divided. Devices that round differently differ by that much.

Where a worker fails nothing of its shares has come into the film. It is left out, and others get its shares.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from ..device.launch import IN_FLIGHT
from ..device.memory import check_host
from ..device.open import Device
from ..errors import DeviceError, NoRoomError
from .accumulation import Accumulation
from .compile import CompiledScene
from .film import Film
from .loop_limit import check_samples
from .on_device import SceneOnDevice
from .session import FEWEST_TILES, Session, first_launch
from .tiles import TILE_PIXELS, row_by_row, tile_by_tile
from .work import Work
from .worker import Share, Worker

#: Launches of a pass on each device, about: at its end some wait for others.
PASS_LAUNCHES = 12
#: The smallest share is such a part of what fills a launch.
SMALLEST = 16
PAUSE = 5e-4
_log = logging.getLogger(__name__)


class Crew(Accumulation):
    """Renders samples of one scene at one size, compiled for each device. DeviceError where none is left."""

    def __init__(self, devices: Sequence[Device], compiled: Sequence[CompiledScene], size: tuple[int, int],
                 max_depth: int, seed: int, planned_spp: int | None = None,
                 before: Sequence[SceneOnDevice] = ()) -> None:
        super().__init__(size)
        tiles = self.work.samples.size
        pixel = compiled[0].choices.pixel
        check_host(tiles * TILE_PIXELS * pixel.itemsize, *size)
        self._film = np.zeros((tiles, TILE_PIXELS), pixel)
        self.workers: list[Worker] = []
        self.lost: list[Worker] = []
        for device, scene in zip(devices, compiled):
            launch = first_launch(scene, size, max_depth, seed, planned_spp)
            try:
                self.workers.append(Worker(device, scene, launch, tiles, before))
            except DeviceError as error:
                if len(devices) == 1:
                    raise
                _log.warning("%s is left out: %s", device.info.name, error)
                failure = error
        if not self.workers:
            raise failure

    @property
    def scene(self) -> SceneOnDevice:
        """The scene on the first device that is still there."""
        return self.workers[0].scene

    @property
    def scenes(self) -> list[SceneOnDevice]:
        """The scene on every device that is still there."""
        return [worker.scene for worker in self.workers]

    def shares(self) -> list[dict[str, Any]]:
        """What each device did, for the report."""
        return [{"device": worker.name, "platform": worker.scene.device.info.platform, "samples": worker.samples,
                 "longest_launch_seconds": worker.launches.longest, "lost": worker in self.lost}
                for worker in [*self.workers, *self.lost]]

    @property
    def longest_launch(self) -> float:
        """Seconds of the launch that took longest, with its transfers."""
        return max(worker.launches.longest for worker in [*self.workers, *self.lost])

    @property
    def _busy(self) -> bool:
        return bool(self.work.parts or self._shares())

    def _shares(self) -> list[Share]:
        return [share for worker in self.workers for share in worker.at]

    def _work(self) -> Iterator[None]:
        while self._busy:
            for worker in [*self.workers] * IN_FLIGHT:
                self._feed(worker)
            if self._collect():
                yield
            else:
                time.sleep(PAUSE)
        self.work.settle()

    def _feed(self, worker: Worker) -> None:
        """Gives a worker that has too little in flight a share, smaller near the end, so that all end together."""
        if worker in self.lost or worker.launches.full:
            return
        size = worker.launches.size / TILE_PIXELS
        fair = self.work.left * worker.launches.size / sum(other.launches.size for other in self.workers) / 2
        busy = [share.part for share in self._shares()]
        part = self.work.cut(int(min(size, max(fair, size / SMALLEST))), FEWEST_TILES, worker.window_tiles,
                             worker.scene.most_samples, busy)
        if part is None:
            return
        tiles = self.work.tiles[part.first:part.end]
        try:
            worker.begin(Share(part, tiles, self._film[tiles]))
        except DeviceError as error:
            self.work.give_back(part)
            self._leave_out(worker, error)

    def _collect(self) -> int:
        """Takes what has been rendered into the film, and tells how many shares that were."""
        count = 0
        for worker in list(self.workers):
            try:
                while share := worker.ended():
                    self._film[share.tiles] = share.pixels
                    count += 1
            except DeviceError as error:
                self._leave_out(worker, error)
        return count

    def _leave_out(self, worker: Worker, error: DeviceError) -> None:
        """Has others do what it was at; it is kept, as giving it up might wait for it."""
        self.workers.remove(worker)
        self.lost.append(worker)
        for share in reversed(worker.at):
            self.work.give_back(share.part)
        if not self.workers:
            raise error
        _log.warning("%s is left out: %s; the others do its work again", worker.name, error)

    def _clear(self) -> None:
        self._film.fill(0)

    def wait(self) -> None:
        """Waits for the launches in flight, and for none that is still in hand."""
        while self._shares():
            if not self._collect():
                time.sleep(PAUSE)
        self.work.settle()

    def pass_limit(self) -> int:
        """As many samples a pixel as keep all busy for some launches."""
        work = sum(worker.launches.size for worker in self.workers)
        return max(1, PASS_LAUNCHES * work // (self.size[0] * self.size[1]))

    def film(self) -> Film:
        """The film so far; waits for the launches in flight."""
        self.wait()
        film = Film(row_by_row(self._film, self.size))
        for worker in self.workers:
            check_samples(worker.scene.device, film, self.work, self.size)
        return film

    def restore(self, film: Film, work: Work) -> None:
        """Goes on from a film of this size and the work that it was rendered by."""
        self.work, self._film = work, tile_by_tile(film.pixels)


def make_picture(devices: Sequence[Device], compiled: Sequence[CompiledScene], size: tuple[int, int], max_depth: int,
                 seed: int, planned_spp: int | None, before: Sequence[SceneOnDevice] = ()) -> Accumulation:
    """A session where there is one device with room for the film, else a crew; before: see `SceneOnDevice`."""
    if len(devices) == 1:
        with suppress(NoRoomError):
            return Session(devices[0], compiled[0], size, max_depth, seed, planned_spp, before)
    return Crew(devices, compiled, size, max_depth, seed, planned_spp, before)
