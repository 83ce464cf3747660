"""Accumulation on a single device, with the film in device memory."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import chain

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from ...device.launches.device_arrays import on_device
from ...device.launches.launch import Launches, LaunchEvents, calling, wait_for
from ...device.launches.lent_memory import begin_copy
from ...device.open import Device
from ...errors import NoRoomError
from ..compile.compile_scene import CompiledScene
from ..film.film import Film
from ..film.host_memory import HostMemory
from ..film.tiles import TILE_PIXELS
from .checked_loops import check_samples
from .launch_plan import FEWEST_TILES, LaunchPlan, first_launch_samples
from .local import LocalAccumulation
from .scene_on_device import SceneOnDevice, largest_film
from .work_queue import WorkQueue

#: Approximate number of launches per pass, unless a single sample per pixel needs more.
PASS_LAUNCHES = 4
#: Fill pattern for a black film; the size of every pixel record is a multiple of its size.
BLACK = np.zeros(8, np.uint32)


class _Tiles:
    """Tile numbers and a device buffer of them. New numbers get a new buffer, since the old one may be in use."""

    def __init__(self, device: Device, numbers: NDArray[np.uint32]) -> None:
        with calling():
            self.numbers, self.buffer = numbers, on_device(device, numbers)


class SingleDeviceAccumulation(LocalAccumulation):
    """Accumulation of one compiled scene at one size, on one device. Raises NoRoomError if scene or film do not fit."""

    def __init__(
        self, device: Device, compiled: CompiledScene, plan: LaunchPlan, before: Sequence[SceneOnDevice] = ()
    ) -> None:
        size = plan.size
        super().__init__(size)
        film_bytes = size[0] * size[1] * compiled.pixel.itemsize
        if film_bytes > largest_film(device, compiled):
            raise NoRoomError(
                f"{device.info.name}: a film of {size[0]}x{size[1]} does not fit into a buffer; use a smaller --size"
            )
        self._scene = SceneOnDevice(device, compiled, plan.record(compiled), film_bytes, before=before)
        self._copies = HostMemory(size[::-1], compiled.pixel)  # everything else has been allocated
        self._launches = Launches(first_launch_samples(compiled), self._scene.most_work)
        with self._scene.allocating():
            self._film = on_device(device, np.zeros(size[0] * size[1], compiled.pixel))
            self._tiles = _Tiles(device, np.zeros(1, np.uint32))
            self._scene.warm_up(self._film, self._tiles.buffer)

    @property
    def scene(self) -> SceneOnDevice:
        """The scene on this session's device."""
        return self._scene

    @property
    def longest_launch(self) -> float:
        """Duration of the longest launch in seconds."""
        return self._launches.longest

    def advance_ahead(self, room: Callable[[int], int]) -> Iterator[None] | None:
        """See Accumulation; call it only if no launch is in flight."""
        launches = self.advance(room)
        next(launches)
        return chain((None,), launches)

    def _work(self) -> Iterator[None]:
        while share := self.work.cut(
            self._launches.size // TILE_PIXELS, FEWEST_TILES, most_samples=self._scene.most_samples
        ):
            pixels = (share.end - share.first) * TILE_PIXELS
            self.launch["first_pixel"], self.launch["pixel_count"] = share.first * TILE_PIXELS, pixels
            self.launch["first_sample"], self.launch["sample_count"] = share.samples, share.more
            events = self._launch()
            self.work.settle()  # before waiting, which Ctrl-C may interrupt
            self._launches.add(events, pixels * share.more)
            yield

    def _launch(self) -> LaunchEvents:
        """Enqueue the integrator for the range in the launch record."""
        if self._tiles.numbers is not self.work.tiles:
            self._tiles = _Tiles(self.device, self.work.tiles)
        return self._scene.enqueue_pixels(self._film, self._tiles.buffer)

    def _clear(self) -> None:
        with calling():
            cl.enqueue_fill_buffer(self.device.queue, self._film, BLACK, 0, self._film.size)

    def wait(self) -> None:
        """Wait for the launches in flight."""
        self._launches.wait()

    def pass_limit(self) -> int:
        """Return the maximum samples per pixel for one pass, so that stopping inside a pass leaves an even image."""
        pixels, work = self.size[0] * self.size[1], self._launches.size
        return max(1, min(PASS_LAUNCHES * work // pixels, work // min(pixels, FEWEST_TILES * TILE_PIXELS)))

    def film(self) -> Film:
        """Return the current film; waits for the launches in flight."""
        self.wait()
        pixels = self._copies.array()
        with calling():
            copied = begin_copy(self.device, pixels, self._film)
        wait_for(copied)
        film = Film(pixels, self.backdrop)
        check_samples(self.device, film, self.work, self.size)
        return film

    def restore(self, film: Film, work: WorkQueue) -> None:
        """Resume from a film of this size and the work that produced it."""
        self.work = work
        with calling():
            copied = begin_copy(self.device, self._film, film.pixels)
        wait_for(copied)
