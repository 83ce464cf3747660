"""One of the devices that render a picture together. It has no film, only the pixels of what it is at."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from ..device.launch import IN_FLIGHT, Launches, calling
from ..device.lending import begin_copy
from ..device.open import Device
from ..errors import NoRoomError
from .compile import CompiledScene
from .on_device import WINDOW, SceneOnDevice, largest_film
from .session import FEWEST_TILES, first_launch_samples
from .tiles import TILE_PIXELS
from .work import Part


class Window(NamedTuple):
    """Room on the device for the pixels of a launch, in the order of its tiles, and for their numbers."""

    film: cl.Buffer
    tiles: cl.Buffer


class Share(NamedTuple):
    """What a worker is at: tiles of the picture, and the rows that they are of the film.

    pixels: (tiles, TILE_PIXELS), as they were before it, and once it has ended after it.
    """

    part: Part
    rows: NDArray[np.uint32]
    tiles: NDArray[np.uint32]
    pixels: NDArray[Any]


class Worker:
    """Renders shares of a picture of so many tiles. DeviceError where it cannot, or not any more."""

    def __init__(self, device: Device, compiled: CompiledScene, launch: NDArray[Any], tiles: int,
                 before: Sequence[SceneOnDevice] = ()) -> None:
        self._tile_bytes = TILE_PIXELS * compiled.choices.pixel.itemsize
        self.window_tiles = max(1, min(tiles, min(WINDOW, largest_film(device, compiled)) // self._tile_bytes))
        film_bytes = IN_FLIGHT * self.window_tiles * self._tile_bytes
        self.scene = SceneOnDevice(device, compiled, launch, film_bytes, windows=True, before=before)
        self._windows = self._make_windows()
        self.launches = Launches(first_launch_samples(compiled))
        self.at: deque[Share] = deque()
        self.samples = 0

    @property
    def name(self) -> str:
        """The device's."""
        return self.scene.device.info.name

    def _make_windows(self) -> deque[Window]:
        """Of half the size as long as there is no room for them."""
        context, flags = self.scene.device.context, cl.mem_flags.READ_WRITE
        while True:
            try:
                with self.scene.allocating():
                    windows = [Window(cl.Buffer(context, flags, self.window_tiles * self._tile_bytes),
                                      cl.Buffer(context, flags, self.window_tiles * 4)) for _ in range(IN_FLIGHT)]
                    for window in windows:
                        self.scene.warm_up(*window)
                return deque(windows)
            except NoRoomError:
                if self.window_tiles <= FEWEST_TILES:
                    raise
                self.window_tiles //= 2
                self.scene.film_bytes = IN_FLIGHT * self.window_tiles * self._tile_bytes

    def begin(self, share: Share) -> None:
        """Enqueues a share of at most `window_tiles` tiles; its arrays belong to the device until it has ended."""
        part, device, window = share.part, self.scene.device, self._windows[0]
        self._windows.rotate(1)
        pixels, launch = len(share.tiles) * TILE_PIXELS, self.scene.launch
        launch["first_pixel"], launch["pixel_count"] = 0, pixels
        launch["first_sample"], launch["sample_count"] = part.samples, part.more
        with calling():
            begin_copy(device, window.tiles, share.tiles)
            begin_copy(device, window.film, share.pixels)
            event = self.scene.enqueue_pixels(window.film, window.tiles)
            last = begin_copy(device, share.pixels, window.film)
            device.queue.flush()
        self.at.append(share)
        self.launches.begin(event, last, pixels * part.more)

    def ended(self) -> Share | None:
        """The first share that it is at, if that has ended."""
        if not self.launches.poll():
            return None
        share = self.at.popleft()
        self.samples += len(share.tiles) * TILE_PIXELS * share.part.more
        return share
