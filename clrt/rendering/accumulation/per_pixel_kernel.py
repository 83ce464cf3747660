"""Execution of a kernel over all pixels of an image, independent of its samples."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from ...accel.layouts import NO_RAYS
from ...device.launches.device_arrays import DeviceArray, empty_array, resident
from ...device.launches.launch import Launches, LaunchEvents
from ...device.programs.program import build, make_kernel
from ...errors import UsageError
from ..film.tiles import TILE_PIXELS, row_by_row, scattered
from .accumulation import Accumulation
from .checked_loops import check_pixels, mark_pixels
from .launch_plan import FEWEST_TILES, FIRST_LAUNCH_SAMPLES, block_bits, first_launch_samples
from .scene_on_device import WINDOW, WINDOWS

#: Kernels kept with a scene on a device.
MOST_KEPT = 4


@dataclass(frozen=True)
class PerPixelKernel:
    """A kernel that takes the scene, the records of a launch, the tiles and the launch, like `path`, and writes a
    record for each pixel; with the launch size that it has reached."""

    kernel: cl.Kernel
    record: np.dtype[Any]
    launches: Launches


def per_pixel_kernel(
    session: Accumulation, key: Hashable, name: str, program: Callable[[], tuple[str, np.dtype[Any]]]
) -> PerPixelKernel:
    """Return kernel `name` of the program text, and the record that it writes, which `program` returns.

    The scene on the device keeps the last kernels by their `key`: views from other cameras compose no text and start
    with launches of the right size.

    Raises KernelError and DeviceError if the device fails, and UsageError if the renderer was made without `first_hits`
    and traces no rays.
    """
    if session.compiled.tree is NO_RAYS:
        raise UsageError(
            "this image traces no rays, so there is no BVH for them: request first hits when creating "
            "the renderer (first_hits=True)"
        )
    kept = session.scene.per_pixel_kernels
    if key not in kept:
        source, record = program()
        kernel = make_kernel(session.device, build(session.device, WINDOWS + source), name)
        first = min(FIRST_LAUNCH_SAMPLES, first_launch_samples(session.compiled))
        kept[key] = PerPixelKernel(kernel, record, Launches(first))
        for old in list(kept)[:-MOST_KEPT]:
            del kept[old]
    return kept[key]


def render_pixels(session: Accumulation, made: PerPixelKernel, samples: int, first_sample: int = 0) -> NDArray[Any]:
    """Return (height, width) records of the session's image, written in bounded launches.

    samples, first_sample: in the launch record. Raises KernelError and DeviceError if the device fails.
    """
    device, record, launches = session.device, made.record, made.launches
    order = scattered(session.tile_samples.size).astype(np.uint32)
    most = max(1, min(len(order), min(WINDOW, device.info.max_alloc_bytes) // (TILE_PIXELS * record.itemsize)))
    tiles = resident(device, order + np.uint32(session.first_tile))
    window = empty_array(device, record, most * TILE_PIXELS)
    records = np.empty(len(order) * TILE_PIXELS, record)
    launch, done = session.launch.copy(), 0
    launch["first_sample"], launch["sample_count"] = first_sample, samples
    launch["block_bits"] = block_bits(samples)
    work = TILE_PIXELS * max(samples, 1)
    while done < len(order):
        count = min(len(order) - done, most, max(FEWEST_TILES, launches.size // work))
        launch["first_pixel"], launch["pixel_count"] = done * TILE_PIXELS, count * TILE_PIXELS
        mark_pixels(device, window)
        made.kernel.set_args(*session.scene_arguments, window.buffer, tiles.buffer, launch[0])
        event = session.enqueue(made.kernel, count * TILE_PIXELS)
        launches.add(LaunchEvents(event, event), count * work)
        launches.wait()
        part = DeviceArray(window.buffer, record, count * TILE_PIXELS)
        part.read(device, records[done * TILE_PIXELS : (done + count) * TILE_PIXELS])
        done += count
    values = np.take(records, _places(order, session.size))
    check_pixels(device, values)
    return values


def _places(order: NDArray[np.uint32], size: tuple[int, int]) -> NDArray[np.intp]:
    """Return (height, width), the index of each pixel among those of the tiles in this order."""
    firsts = np.empty(len(order), np.intp)
    firsts[order] = np.arange(len(order)) * TILE_PIXELS
    return row_by_row(firsts[:, None] + np.arange(TILE_PIXELS), size)
