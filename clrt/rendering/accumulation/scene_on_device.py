"""Compiled scene on a device: program built and buffers uploaded, ready to render pixels."""

from __future__ import annotations

import time
from collections.abc import Hashable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from ...device.driver_errors import driver_errors
from ...device.launches.device_arrays import lent, on_host, same_content
from ...device.launches.hang_watchdog import warming_up
from ...device.launches.launch import LaunchEvents, calling, wait_for
from ...device.memory_plan import array_bytes, check_memory, part_count, part_records, parts, size
from ...device.open import Device
from ...device.programs.background_compile import in_background
from ...device.programs.program import BuiltProgram, build, make_kernel
from ...errors import NoRoomError
from ...scene.model import Camera
from ..compile.camera_kernel import camera_fields, launch_record
from ..compile.compile_scene import QUEUES, RASTER, CompiledScene
from ..compile.film_record import launch_type
from .checked_loops import most_samples
from .path_queues import PathQueues
from .raster_bins import RasterBins

if TYPE_CHECKING:
    from .per_pixel_kernel import PerPixelKernel

#: Defined in programs whose film holds only the pixels of a launch.
WINDOWS = "#define FILM_WINDOWS 1\n"
#: Maximum size of such a film on the device, in bytes.
WINDOW = 64 << 20
#: Bytes of a kernel's parameters besides pointers to the scene's arrays and its counts: two pointers.
OTHER_PARAMETERS = 16


def largest_film(device: Device, compiled: CompiledScene) -> int:
    """Return the maximum size of a film on the device, in bytes."""
    pixel = compiled.pixel.itemsize
    if compiled.part_bytes is None:
        return device.info.max_alloc_bytes
    return part_records(pixel, compiled.part_bytes) * pixel


class SceneOnDevice:
    """Scene on a device. launch: the LAUNCH record, whose ranges its user sets; film_bytes: size of the film on the
    device; windows: whether the film holds only the pixels of a launch. before: scenes no longer needed, whose program
    and buffers are reused where they are the same.

    Raises DeviceError, with the numbers, if scene and film do not fit, and KernelError.
    """

    def __init__(
        self,
        device: Device,
        compiled: CompiledScene,
        launch: NDArray[Any],
        film_bytes: int,
        windows: bool = False,
        before: Sequence[SceneOnDevice] = (),
    ) -> None:
        self.device, self.compiled, self.launch, self.film_bytes = device, compiled, launch, film_bytes
        #: Other kernels of this scene (`per_pixel_kernel`).
        self.per_pixel_kernels: dict[Hashable, PerPixelKernel] = {}
        self._bins: RasterBins | None = None
        self._queues: PathQueues | None = None
        self._check_memory()
        primitives = int(compiled.counts["triangles"][0] + compiled.counts["spheres"][0])
        #: Maximum samples per pixel in one launch; None if unlimited.
        self.most_samples = most_samples(device, compiled.tree, primitives, int(launch["max_depth"][0]))
        self._windows = windows
        last = next((each for each in before if each.device is device), None)
        self._warm = last is not None and last._windows == windows and last.compiled.has_text_of(compiled)
        self.program: BuiltProgram = (
            last.program if last and self._warm else build(device, WINDOWS * windows + compiled.source, compiled.bytes)
        )
        with self.allocating():
            self._buffers = {
                name: last and last._buffer(name, array) or self._uploaded(array)
                for name, (_, array) in compiled.buffers.items()
            }
        self._kernel = make_kernel(device, self.program, compiled.kernel)
        #: Leading arguments of every kernel of the scene (SCENE_PARAMETERS).
        self.scene_arguments = [*sum(self._buffers.values(), []), compiled.counts[0]]
        if compiled.entry == RASTER:
            self._bins = RasterBins(device, compiled, self.scene_arguments)
        if compiled.entry == QUEUES:
            self._queues = PathQueues(device, self.program, compiled, self.scene_arguments)
        self.build_seconds = 0.0 if self._warm else self.program.build_seconds

    def _uploaded(self, array: Any) -> list[cl.Buffer]:
        if self.compiled.part_bytes is None:
            return [lent(self.device, array)]
        values = on_host(self.device, array)
        return [lent(self.device, part) for part in parts(values, self.compiled.part_bytes)]

    def _buffer(self, name: str, array: Any) -> list[cl.Buffer] | None:
        """Return the buffer of this name if its content equals an array."""
        own = self.compiled.buffers.get(name, (None, None))[1]
        kept = isinstance(array, np.ndarray) or self.compiled.part_bytes is None  # parts are copies
        return self._buffers[name] if kept and same_content(own, array) else None

    @property
    def device_bytes(self) -> int:
        """Memory of all buffers on the device."""
        return self.compiled.bytes + self.film_bytes + sum(own.bytes for own in (self._bins, self._queues) if own)

    @property
    def most_work(self) -> int | None:
        """Maximum samples of all pixels in one launch; None if unlimited."""
        return self._queues.capacity if self._queues else None

    @property
    def _needs(self) -> dict[str, int]:
        """Device memory in bytes by purpose, except for the raster bins."""
        arrays = self.compiled.buffers.items()
        return {
            **{name: array_bytes(array, self.compiled.part_bytes) for name, (_, array) in arrays},
            "film": self.film_bytes,
        }

    def _check_memory(self) -> None:
        compiled, part_bytes = self.compiled, self.compiled.part_bytes
        pointers = sum(part_count(array, part_bytes) for _, array in compiled.buffers.values())
        check_memory(
            self.device.info,
            self._needs,
            8 * pointers + compiled.counts.itemsize + self.launch.itemsize + OTHER_PARAMETERS,
            self.device.cl.max_parameter_size,
        )

    @contextmanager
    def allocating(self) -> Iterator[None]:
        """Context for device allocations. Raises NoRoomError if memory is exhausted, and DeviceError if the device
        fails."""
        try:
            with driver_errors():
                yield
        except NoRoomError as error:
            raise NoRoomError(f"{self.device.info.name}: {size(self.device_bytes)} do not fit: {error}") from error

    def look(self, camera: Camera) -> None:
        """Use this camera for subsequent launches; its kernel file must be that of the previous one."""
        self.compiled = self.compiled.seen_by(camera, *self.compiled.chosen_files["CAMERA"])
        width, height = int(self.launch["width"][0]), int(self.launch["height"][0])
        record = launch_record(self.compiled.camera, (width, height), launch_type(self.compiled.features))
        for name in camera_fields(record.dtype):
            self.launch[name] = record[name]

    def warm_up(self, film: cl.Buffer, tiles: cl.Buffer) -> None:
        """Launch an empty range, because some drivers compile or allocate at the first launch; counts as build time."""
        if self._warm:
            return
        start = time.perf_counter()
        self.launch["pixel_count"] = 0
        with warming_up():
            wait_for(in_background(self.device.info.name, lambda: self.enqueue_pixels(film, tiles)).last)
        self.build_seconds += time.perf_counter() - start

    def enqueue_pixels(self, film: cl.Buffer, tiles: cl.Buffer) -> LaunchEvents:
        """Enqueue the integrator for the range in the launch record, of the image's tiles in `tiles`; of a scene with
        catchers once with its objects and once without."""
        if "bare" not in (self.launch.dtype.names or ()):
            return self._enqueue_world(film, tiles)
        worlds = []
        for self.launch["bare"] in (0, 1):
            worlds.append(self._enqueue_world(film, tiles))
        return LaunchEvents(worlds[0].first, worlds[-1].last)

    def _enqueue_world(self, film: cl.Buffer, tiles: cl.Buffer) -> LaunchEvents:
        if self._queues:
            with self.allocating():
                return self._queues.enqueue(film, tiles, self.launch)
        bins = self._bins.of(self.launch, self._needs) if self._bins else []
        self._kernel.set_args(*self.scene_arguments, film, tiles, self.launch[0], *bins)
        event = self.enqueue(self._kernel, int(self.launch["pixel_count"][0]), self.compiled.pixels)
        return LaunchEvents(event, event)

    def enqueue(self, kernel: cl.Kernel, pixel_count: int, share: int | None = None) -> cl.Event:
        """Enqueue a kernel of the scene, whose arguments are set, for `pixel_count` pixels.

        share: pixels per work-item; None for one per lane.
        """
        local = self.device.local_size
        groups = max(1, -(-pixel_count // ((share or self.compiled.choices.lanes) * local)))
        with calling():
            event = cl.enqueue_nd_range_kernel(self.device.queue, kernel, (groups * local,), (local,))
            self.device.queue.flush()
        return event
