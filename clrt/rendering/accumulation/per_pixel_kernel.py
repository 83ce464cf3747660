"""Execution of a kernel over all pixels of an image, independent of its samples."""

from __future__ import annotations

from typing import Any

import numpy as np
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


def render_pixels(
    session: Accumulation, source: str, name: str, record: np.dtype[Any], samples: int, first_sample: int = 0
) -> NDArray[Any]:
    """Return (height, width) records of the session's image, written by kernel `name` of a program in bounded launches.

    The kernel takes the scene, the records of a launch, the tiles and the launch, like `path`. samples, first_sample:
    in the launch record. Raises KernelError and DeviceError if the device fails, and UsageError if the renderer was
    made without `first_hits` and traces no rays.
    """
    if session.compiled.tree is NO_RAYS:
        raise UsageError(
            "this image traces no rays, so there is no BVH for them: request first hits when creating "
            "the renderer (first_hits=True)"
        )
    device = session.device
    kernel = make_kernel(device, build(device, WINDOWS + source), name)
    order = scattered(session.tile_samples.size).astype(np.uint32)
    most = max(1, min(len(order), min(WINDOW, device.info.max_alloc_bytes) // (TILE_PIXELS * record.itemsize)))
    tiles = resident(device, order + np.uint32(session.first_tile))
    window = empty_array(device, record, most * TILE_PIXELS)
    pixels = np.zeros((len(order), TILE_PIXELS), record)
    first = min(FIRST_LAUNCH_SAMPLES, first_launch_samples(session.compiled))
    launch, launches, done = session.launch.copy(), Launches(first), 0
    launch["first_sample"], launch["sample_count"] = first_sample, samples
    launch["block_bits"] = block_bits(samples)
    work = TILE_PIXELS * max(samples, 1)
    while done < len(order):
        count = min(len(order) - done, most, max(FEWEST_TILES, launches.size // work))
        launch["first_pixel"], launch["pixel_count"] = done * TILE_PIXELS, count * TILE_PIXELS
        mark_pixels(device, window)
        kernel.set_args(*session.scene_arguments, window.buffer, tiles.buffer, launch[0])
        event = session.enqueue(kernel, count * TILE_PIXELS)
        launches.add(LaunchEvents(event, event), count * work)
        launches.wait()
        found = DeviceArray(window.buffer, record, count * TILE_PIXELS).read(device)
        pixels[order[done : done + count]] = found.reshape(count, TILE_PIXELS)
        done += count
    values = row_by_row(pixels, session.size)
    check_pixels(device, values)
    return values
