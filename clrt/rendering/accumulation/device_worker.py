"""Worker: one of several devices that render an image together. It stores the pixels of its shares, but no film."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from ...device.launches.launch import IN_FLIGHT, Launches, calling
from ...device.launches.lent_memory import begin_copy
from ...device.open import Device
from ...errors import NoRoomError
from ..compile.compile_scene import CompiledScene
from ..film.tiles import TILE_PIXELS
from .launch_plan import FEWEST_TILES, first_launch_samples
from .scene_on_device import WINDOW, SceneOnDevice, largest_film
from .work_queue import WorkPart


class LaunchBuffers(NamedTuple):
    """Device buffers for the pixels of a launch, in the order of its tiles, and for the tiles' numbers."""

    film: cl.Buffer
    tiles: cl.Buffer


class WorkerShare(NamedTuple):
    """Unit of a worker's work: tiles of the image, and their rows in the film.

    pixels: (tiles, TILE_PIXELS), the state before the share, and once it has ended the one after it.
    """

    part: WorkPart
    rows: NDArray[np.uint32]
    tiles: NDArray[np.uint32]
    pixels: NDArray[Any]


class DeviceWorker:
    """Renders shares of an image of `tiles` tiles. Raises DeviceError if it cannot, or fails later."""

    def __init__(
        self,
        device: Device,
        compiled: CompiledScene,
        launch: NDArray[Any],
        tiles: int,
        before: Sequence[SceneOnDevice] = (),
    ) -> None:
        self._tile_bytes = TILE_PIXELS * compiled.pixel.itemsize
        self.window_tiles = max(1, min(tiles, min(WINDOW, largest_film(device, compiled)) // self._tile_bytes))
        film_bytes = IN_FLIGHT * self.window_tiles * self._tile_bytes
        self.scene = SceneOnDevice(device, compiled, launch, film_bytes, windows=True, before=before)
        self._windows = self._make_windows()
        self.launches = Launches(first_launch_samples(compiled), self.scene.most_work)
        self.at: deque[WorkerShare] = deque()
        self.samples = 0

    @property
    def name(self) -> str:
        """Name of the device."""
        return self.scene.device.info.name

    def _make_windows(self) -> deque[LaunchBuffers]:
        """Allocate the windows, halving their size until they fit."""
        context, flags = self.scene.device.context, cl.mem_flags.READ_WRITE
        while True:
            try:
                with self.scene.allocating():
                    windows = [
                        LaunchBuffers(
                            cl.Buffer(context, flags, self.window_tiles * self._tile_bytes),
                            cl.Buffer(context, flags, self.window_tiles * 4),
                        )
                        for _ in range(IN_FLIGHT)
                    ]
                    for window in windows:
                        self.scene.warm_up(*window)
                return deque(windows)
            except NoRoomError:
                if self.window_tiles <= FEWEST_TILES:
                    raise
                self.window_tiles //= 2
                self.scene.film_bytes = IN_FLIGHT * self.window_tiles * self._tile_bytes

    def begin(self, share: WorkerShare) -> None:
        """Enqueue a share of at most `window_tiles` tiles; its arrays must not be used until it has ended."""
        part, device, window = share.part, self.scene.device, self._windows[0]
        self._windows.rotate(1)
        pixels, launch = len(share.tiles) * TILE_PIXELS, self.scene.launch
        launch["first_pixel"], launch["pixel_count"] = 0, pixels
        launch["first_sample"], launch["sample_count"] = part.samples, part.more
        with calling():
            begin_copy(device, window.tiles, share.tiles)
            begin_copy(device, window.film, share.pixels)
            events = self.scene.enqueue_pixels(window.film, window.tiles)
            last = begin_copy(device, share.pixels, window.film)
            device.queue.flush()
        self.at.append(share)
        self.launches.begin(events, last, pixels * part.more)

    def ended(self) -> WorkerShare | None:
        """Return the oldest share in flight if it has ended, else None."""
        if not self.launches.poll():
            return None
        share = self.at.popleft()
        self.samples += len(share.tiles) * TILE_PIXELS * share.part.more
        return share
