"""A picture in the making, whoever renders it: which samples it has, and how it gets more."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from ..device.open import Device
from ..scene.model import Camera, Scene
from .compile import CompiledScene
from .film import Film
from .on_device import SceneOnDevice
from .tiles import mean_samples, tiles_of
from .work import Work


class Accumulation(ABC):
    """The samples of one compiled scene at one size. Nothing depends on how the work is cut, or on who does it."""

    #: Its number in the scene's whole picture.
    first_tile = 0

    def __init__(self, size: tuple[int, int]) -> None:
        self.size = size
        self.work = Work(np.zeros(tiles_of(size), np.int64))
        self._torn = False

    @property
    def tile_samples(self) -> NDArray[np.int64]:
        """(rows, columns) samples that the pixels of each tile have, or had before the work in hand."""
        return self.work.samples

    @property
    def samples_done(self) -> int:
        """Samples a pixel, the mean over all, rounded."""
        return mean_samples(self.tile_samples, self.size)

    def render(self, samples: int) -> Iterator[None]:
        """Adds the next `samples` samples to every pixel, in bounded launches; yields after each.

        All tiles must have as many. If it is left before its end, the next call, of `double` too, first ends that.
        """
        self.mend()
        if not self._busy:
            self.work.add_to_all(samples)
        yield from self._run()

    def advance(self, room: Callable[[int], int]) -> Iterator[None]:
        """Adds a pass: as many samples to every pixel as there is `room` for after those done, `pass_limit` at most;
        otherwise like `render`. Of more samples than are done room tells what may follow; 0 where nothing does."""
        yield from self.render(max(1, min(room(self.samples_done), self.pass_limit())))

    def advance_ahead(self, room: Callable[[int], int]) -> Iterator[None] | None:
        """Like `advance`, but the first launch is made now; None where that would have to wait for something."""
        return None

    def double(self, tiles: NDArray[np.intp]) -> Iterator[None]:
        """Doubles the samples of these tiles, by their number in `tile_samples`; otherwise like `render`."""
        self.mend()
        if not self._busy:
            self.work.double(tiles)
        yield from self._run()

    @property
    def _busy(self) -> bool:
        """Whether there is work in hand."""
        return bool(self.work.parts)

    def work_left(self) -> Work:
        """The work as a checkpoint keeps it, beside the film as it is now."""
        return self.work

    def _run(self) -> Iterator[None]:
        with self._tearing():
            yield from self._work()

    @contextmanager
    def _tearing(self) -> Iterator[None]:
        """Around what an exception, as of Ctrl-C, may end between two steps, so that the film has not what the work
        says."""
        try:
            yield
        except GeneratorExit:    # it comes between launches
            raise
        except BaseException:
            self._torn = True
            raise

    def mend(self) -> None:
        """Where the work was torn it becomes what the film has not; where it was left after its last launch it ends."""
        if self._torn:
            self.wait()
            self.work.take_stock(self.film().tile_samples)
            self._torn = False
        elif not self._busy:
            self.work.settle()

    def _settle(self) -> None:
        """Where nothing is in hand or in flight; of torn work it is not known what is missing."""
        if not self._torn:
            self.work.settle()

    @abstractmethod
    def _work(self) -> Iterator[None]:
        """Launches what is in hand."""

    def look(self, camera: Camera) -> None:
        """Begins anew, without any samples, as this camera sees the scene (see `SceneOnDevice.look`)."""
        self.wait()
        self.work, self._torn = Work(np.zeros(tiles_of(self.size), np.int64)), False
        for scene in self.scenes:
            scene.look(camera)
        self._clear()

    @abstractmethod
    def _clear(self) -> None:
        """Makes the film black."""

    @abstractmethod
    def wait(self) -> None:
        """Waits for the launches in flight."""

    @abstractmethod
    def pass_limit(self) -> int:
        """The most samples a pixel that one pass should add, so that ending inside a pass leaves an even picture."""

    @abstractmethod
    def film(self) -> Film:
        """The film so far; waits for the launches in flight."""

    def whole_film(self) -> Film:
        """The film, which has what the work says, whatever was interrupted."""
        self.mend()
        return self.film()

    @abstractmethod
    def restore(self, film: Film, work: Work) -> None:
        """Goes on from a film of this size and the work that it was rendered by."""

    @property
    @abstractmethod
    def scene(self) -> SceneOnDevice:
        """The scene where other kernels can be run on it."""

    @property
    @abstractmethod
    def longest_launch(self) -> float:
        """Seconds of the launch that took longest."""

    @property
    def scenes(self) -> list[SceneOnDevice]:
        """The scene on every device that is still there."""
        return [self.scene]

    @property
    def build_seconds(self) -> float:
        """What building its programs took."""
        return sum(scene.build_seconds for scene in self.scenes)

    @property
    def cached(self) -> bool:
        """Whether all programs had been built before."""
        return all(scene.program.cached for scene in self.scenes)

    @property
    def device_bytes(self) -> int:
        """Memory of all buffers, on the device that has most."""
        return max(scene.device_bytes for scene in self.scenes)

    def shares(self) -> list[dict[str, Any]]:
        """What each of several devices did, for the report."""
        return []

    def machine(self, devices: Sequence[Device]) -> dict[str, Any]:
        """What a report says of these devices, which were to render it, and of what they built."""
        from .machine import machine_report    # like the next two it takes a whole Accumulation

        return machine_report(devices, self)

    def guides(self) -> dict[str, NDArray[np.float32]]:
        """What guides a denoiser: see `render_guides`."""
        from .guides import render_guides

        return render_guides(self)

    def first_hits(self, scene: Scene, names: Collection[str]) -> dict[str, NDArray[np.generic]]:
        """What is seen first of the scene that this is of: see `first_hits`."""
        from .first_hits import first_hits

        return first_hits(self, scene, names)

    @property
    def device(self) -> Device:
        """The scene's."""
        return self.scene.device

    @property
    def compiled(self) -> CompiledScene:
        """The scene's."""
        return self.scene.compiled

    @property
    def launch(self) -> NDArray[Any]:
        """The scene's LAUNCH record."""
        return self.scene.launch

    @property
    def scene_arguments(self) -> list[Any]:
        """What every kernel of the scene takes first."""
        return self.scene.scene_arguments

    def enqueue(self, kernel: cl.Kernel, pixel_count: int) -> cl.Event:
        """See `SceneOnDevice.enqueue`."""
        return self.scene.enqueue(kernel, pixel_count)
