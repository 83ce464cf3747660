"""A scene on a device: program built, buffers uploaded, samples rendered on demand into the film."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from ..device.arrays import on_device
from ..device.background import in_background
from ..device.launch import Launches, wait_for
from ..device.open import Device
from ..device.program import BuiltProgram, build, make_kernel
from ..errors import DeviceError
from .camera import launch_record
from .compile import CompiledScene
from .film import Film
from .loop_limit import check_samples, most_samples
from .tiles import TILE_PIXELS, tile_pixels, tiles_of
from .work import Part, Work

#: Tiles of a launch, at least.
FEWEST_TILES = 16
#: Launches of a pass, about, unless a single sample a pixel takes more.
PASS_LAUNCHES = 4
FIRST_LAUNCH_SAMPLES = 1 << 15


class Session:
    """Renders samples of one compiled scene at one size. Nothing depends on how the work is cut into launches."""

    def __init__(self, device: Device, compiled: CompiledScene, size: tuple[int, int], max_depth: int,
                 seed: int, planned_spp: int | None = None) -> None:
        self.device, self.compiled, self.size = device, compiled, size
        self.program: BuiltProgram = build(device, compiled.source)
        self.launch = launch_record(compiled.camera, size)
        self.launch["max_depth"], self.launch["seed"] = max_depth, seed
        self.launch["block_bits"] = block_bits(planned_spp)
        self.work = Work(np.zeros(tiles_of(size), np.int64))
        self._launches = Launches(FIRST_LAUNCH_SAMPLES)
        primitives = int(compiled.counts["triangles"][0] + compiled.counts["spheres"][0])
        self._most_samples = most_samples(device, compiled.tree, primitives, max_depth)
        width, height = size
        self._check_memory()
        try:
            scene = [on_device(device, array) for _, array in compiled.buffers.values()]
            self._film = on_device(device, np.zeros(width * height, compiled.choices.pixel))
            self._tiles = on_device(device, np.zeros(1, np.uint32))
        except cl.Error as error:
            raise DeviceError(f"{device.info.name}: {self.device_bytes} bytes do not fit: {error}") from error
        self._kernel = make_kernel(device, self.program, compiled.kernel)
        #: What every kernel of the scene takes first (SCENE_PARAMETERS).
        self.scene_arguments = [*scene, compiled.counts[0]]
        self._kernel.set_args(*self.scene_arguments, self._film, self._tiles, self.launch[0])
        self._warm_up()

    def _check_memory(self) -> None:
        """DeviceError with the numbers where the picture or a buffer of the scene cannot fit."""
        info, (width, height) = self.device.info, self.size
        film = width * height * self.compiled.choices.pixel.itemsize
        largest = max([film, *(a.nbytes for _, a in self.compiled.buffers.values())])
        if largest > info.max_alloc_bytes or self.device_bytes > info.global_bytes:
            raise DeviceError(f"{info.name}: a picture of {width}x{height} and its scene need {self.device_bytes} "
                              f"bytes, {largest} of them in one buffer; the device has {info.global_bytes}, and at "
                              f"most {info.max_alloc_bytes} in one; render a smaller --size")

    def _warm_up(self) -> None:
        """Launches no work: some drivers compile at the first launch, which belongs to the time of the build."""
        start = time.perf_counter()
        wait_for(in_background(self.device.info.name, self._launch))
        self.build_seconds = self.program.build_seconds + time.perf_counter() - start

    @property
    def device_bytes(self) -> int:
        """Memory of all buffers on the device."""
        return self.compiled.bytes + self.size[0] * self.size[1] * self.compiled.choices.pixel.itemsize

    @property
    def tile_samples(self) -> NDArray[np.int64]:
        """(rows, columns) samples that the pixels of each tile have, or had before the work in hand."""
        return self.work.samples

    @property
    def samples_done(self) -> int:
        """Samples a pixel, the mean over all, rounded."""
        width, height = self.size
        return round(int(np.sum(self.tile_samples * tile_pixels(self.size))) / (width * height))

    def render(self, samples: int) -> Iterator[None]:
        """Adds the next `samples` samples to every pixel, in bounded launches; yields after each.

        All tiles must have as many. If it is left before its end, the next call, of `double` too, first ends that.
        """
        if not self.work.parts:
            every, done = np.arange(self.tile_samples.size), int(self.tile_samples[0, 0])
            self._take_in_hand(every, [Part(0, len(every), done, samples)])
        yield from self._work()

    def double(self, tiles: NDArray[np.intp]) -> Iterator[None]:
        """Doubles the samples of these tiles, by their number in `tile_samples`; otherwise like `render`."""
        if not self.work.parts:
            samples = self.tile_samples.ravel()[tiles]
            order = np.argsort(samples, kind="stable")
            levels, firsts = (found.tolist() for found in np.unique(samples[order], return_index=True))
            self._take_in_hand(tiles[order], [Part(first, end, level, level) for first, end, level
                                              in zip(firsts, [*firsts[1:], len(tiles)], levels)])
        yield from self._work()

    def _take_in_hand(self, tiles: NDArray[np.intp], parts: list[Part]) -> None:
        self.work.take(tiles, parts)
        self._upload_tiles()

    def _upload_tiles(self) -> None:
        if len(self.work.tiles):
            self._tiles = on_device(self.device, self.work.tiles)   # not the last one's, which may be in use
            self._kernel.set_arg(len(self.scene_arguments) + 1, self._tiles)

    def _work(self) -> Iterator[None]:
        """Launches what is in hand."""
        while self.work.parts:
            if self._most_samples is not None:
                self.work.shorten(self._most_samples)
            samples = self.work.parts[0].more * TILE_PIXELS
            share = self.work.cut(max(FEWEST_TILES, self._launches.size // samples))
            tiles = share.end - share.first
            self.launch["first_pixel"], self.launch["pixel_count"] = share.first * TILE_PIXELS, tiles * TILE_PIXELS
            self.launch["first_sample"], self.launch["sample_count"] = share.samples, share.more
            self._launches.add(self._launch(), tiles * samples)
            yield

    def _launch(self) -> cl.Event:
        """Enqueues the kernel for the range in the launch record."""
        self._kernel.set_arg(len(self.scene_arguments) + 2, self.launch[0])
        return self.enqueue(self._kernel, int(self.launch["pixel_count"][0]))

    def enqueue(self, kernel: cl.Kernel, pixel_count: int) -> cl.Event:
        """Enqueues a kernel of the scene, whose arguments are set, for as many pixels."""
        local = self.device.local_size
        groups = max(1, -(-pixel_count // (self.compiled.choices.lanes * local)))
        event = cl.enqueue_nd_range_kernel(self.device.queue, kernel, (groups * local,), (local,))
        self.device.queue.flush()
        return event

    def wait(self) -> None:
        """Waits for the launches in flight."""
        self._launches.wait()

    def pass_limit(self) -> int:
        """The most samples a pixel that one pass should add, so that ending inside a pass leaves an even picture."""
        pixels, work = self.size[0] * self.size[1], self._launches.size
        return max(1, min(PASS_LAUNCHES * work // pixels, work // min(pixels, FEWEST_TILES * TILE_PIXELS)))

    def film(self) -> Film:
        """The film so far; waits for the launches in flight."""
        self.wait()
        pixels = np.empty((self.size[1], self.size[0]), self.compiled.choices.pixel)
        wait_for(cl.enqueue_copy(self.device.queue, pixels, self._film, is_blocking=False))
        film = Film(pixels)
        check_samples(self.device, film, self.work, self.size)
        return film

    def restore(self, film: Film, work: Work) -> None:
        """Goes on from a film of this size and the work that it was rendered by."""
        self.work = work
        self._upload_tiles()
        wait_for(cl.enqueue_copy(self.device.queue, self._film, film.pixels, is_blocking=False))


def block_bits(planned_spp: int | None) -> int:
    """log2 of the samples that a pixel takes from one block of its sampler's sequence (kernels/sampler.cl).

    The least power of two for all `planned_spp`; 32, without an end, where it is not known how many there will be.
    """
    return 32 if planned_spp is None else (planned_spp - 1).bit_length()
