"""Base class of images in progress: which samples they have, and how samples are added."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from ...device.open import Device
from ...scene.model import Camera, Scene
from ..compile.compile_scene import CompiledScene
from ..film.film import Film
from ..film.tiles import mean_samples, tiles_of
from .scene_on_device import SceneOnDevice
from .work_queue import WorkQueue


class Accumulation(ABC):
    """Samples of one compiled scene at one size. The result does not depend on how work is divided or among which
    devices."""

    #: Number of its first tile in the whole image.
    first_tile = 0

    def __init__(self, size: tuple[int, int]) -> None:
        self.size = size
        #: What is behind the scene in its films (see `Film`).
        self.backdrop: NDArray[np.float32] | None = None
        self.work = WorkQueue(np.zeros(tiles_of(size), np.int64))
        self._torn = False

    @property
    def tile_samples(self) -> NDArray[np.int64]:
        """(rows, columns) samples per pixel of each tile, or those before the pending work."""
        return self.work.samples

    @property
    def samples_done(self) -> int:
        """Samples per pixel, averaged over the image and rounded."""
        return mean_samples(self.tile_samples, self.size)

    def render(self, samples: int) -> Iterator[None]:
        """Add the next `samples` samples to every pixel, in bounded launches; yield after each.

        All tiles must have the same sample count. If it is left before its end, the next call, also of `double`,
        finishes that work first.
        """
        self.mend()
        if not self._busy:
            self.work.add_to_all(samples)
        yield from self._run()

    def advance(self, room: Callable[[int], int]) -> Iterator[None]:
        """Add a pass of at most `pass_limit` samples per pixel; otherwise like `render`. `room` maps a sample count,
        which may be ahead of the samples done, to the number of samples that may follow it, 0 if none."""
        yield from self.render(max(1, min(room(self.samples_done), self.pass_limit())))

    def advance_ahead(self, room: Callable[[int], int]) -> Iterator[None] | None:
        """Like `advance`, but make the first launch now; return None if that would have to wait."""
        return None

    def double(self, tiles: NDArray[np.intp]) -> Iterator[None]:
        """Double the samples of these tiles, numbered as in `tile_samples`; otherwise like `render`."""
        self.mend()
        if not self._busy:
            self.work.double(tiles)
        yield from self._run()

    @property
    def _busy(self) -> bool:
        """Whether work is pending."""
        return bool(self.work.parts)

    def work_left(self) -> WorkQueue:
        """Return the work as a checkpoint stores it, along with the current film."""
        return self.work

    def _run(self) -> Iterator[None]:
        with self._tearing():
            yield from self._work()

    @contextmanager
    def _tearing(self) -> Iterator[None]:
        """Mark the work as torn if an exception such as Ctrl-C may have left the film and the work inconsistent."""
        try:
            yield
        except GeneratorExit:  # raised between launches
            raise
        except BaseException:
            self._torn = True
            raise

    def mend(self) -> None:
        """Make work and film consistent: torn work becomes the samples that the film lacks, and work left after its
        last launch is completed."""
        if self._torn:
            self.wait()
            self.work.take_stock(self.film().tile_samples)
            self._torn = False
        elif not self._busy:
            self.work.settle()

    def _settle(self) -> None:
        """Complete the work if nothing is pending or in flight; not if it is torn, as the missing samples are
        unknown."""
        if not self._torn:
            self.work.settle()

    @abstractmethod
    def _work(self) -> Iterator[None]:
        """Launch the pending work."""

    def look(self, camera: Camera) -> None:
        """Start afresh, without samples, from this camera (see `SceneOnDevice.look`)."""
        self.wait()
        self.work, self._torn = WorkQueue(np.zeros(tiles_of(self.size), np.int64)), False
        for scene in self.scenes:
            scene.look(camera)
        self._clear()

    @abstractmethod
    def _clear(self) -> None:
        """Set the film to black."""

    @abstractmethod
    def wait(self) -> None:
        """Wait for the launches in flight."""

    @abstractmethod
    def pass_limit(self) -> int:
        """Return the maximum samples per pixel for one pass, so that stopping inside a pass leaves an even image."""

    @abstractmethod
    def film(self) -> Film:
        """Return the current film; waits for the launches in flight."""

    def whole_film(self) -> Film:
        """Return the film, consistent with the work even after an interruption."""
        self.mend()
        return self.film()

    @abstractmethod
    def restore(self, film: Film, work: WorkQueue) -> None:
        """Resume from a film of this size and the work that produced it."""

    @property
    @abstractmethod
    def scene(self) -> SceneOnDevice:
        """The scene on a device where other kernels can be run on it."""

    @property
    @abstractmethod
    def longest_launch(self) -> float:
        """Duration of the longest launch in seconds."""

    @property
    def scenes(self) -> list[SceneOnDevice]:
        """The scene on every device that is still in use."""
        return [self.scene]

    @property
    def build_seconds(self) -> float:
        """Seconds spent building its programs."""
        return sum(scene.build_seconds for scene in self.scenes)

    @property
    def cached(self) -> bool:
        """Whether all programs came from the cache."""
        return all(scene.program.cached for scene in self.scenes)

    @property
    def device_bytes(self) -> int:
        """Memory of all buffers, on the device that uses most."""
        return max(scene.device_bytes for scene in self.scenes)

    def shares(self) -> list[dict[str, Any]]:
        """Return what each of several devices rendered, for the report."""
        return []

    @abstractmethod
    def machine(self, devices: Sequence[Device]) -> dict[str, Any]:
        """Return the report's fields on these devices, and on the programs and BVHs built for them."""

    @abstractmethod
    def guides(self) -> dict[str, NDArray[np.float32]]:
        """Return the guides for a denoiser, see `render_guides`."""

    @abstractmethod
    def first_hits(self, scene: Scene, names: Collection[str]) -> dict[str, NDArray[np.generic]]:
        """Return AOVs of the first hits in the scene being rendered, see `first_hits`."""

    @property
    def device(self) -> Device:
        """The scene's device."""
        return self.scene.device

    @property
    def compiled(self) -> CompiledScene:
        """The compiled scene."""
        return self.scene.compiled

    @property
    def launch(self) -> NDArray[Any]:
        """The scene's LAUNCH record."""
        return self.scene.launch

    @property
    def scene_arguments(self) -> list[Any]:
        """Leading arguments of every kernel of the scene."""
        return self.scene.scene_arguments

    def enqueue(self, kernel: cl.Kernel, pixel_count: int) -> cl.Event:
        """Enqueue a kernel, see `SceneOnDevice.enqueue`."""
        return self.scene.enqueue(kernel, pixel_count)
