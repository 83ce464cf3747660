"""Runs a kernel once over all pixels of a picture, beside its render."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..device.arrays import empty_array, resident
from ..device.launch import Launches
from ..device.program import build, make_kernel
from .loop_limit import check_pixels, mark_pixels
from .session import FEWEST_TILES, FIRST_LAUNCH_SAMPLES, Session, block_bits
from .tiles import TILE_PIXELS


def render_pixels(session: Session, source: str, name: str, record: np.dtype[Any], samples: int) -> NDArray[Any]:
    """(height, width) records of the session's picture that kernel `name` of a program writes, in bounded launches.

    The kernel takes the scene, the records, the tiles and the launch, as `path` does. samples: what the launch says.
    KernelError and DeviceError where the device fails.
    """
    device, (width, height) = session.device, session.size
    kernel = make_kernel(device, build(device, source), name)
    pixels = empty_array(device, record, width * height)
    mark_pixels(device, pixels)
    tiles = resident(device, np.arange(session.tile_samples.size, dtype=np.uint32))
    launch, launches, done = session.launch.copy(), Launches(FIRST_LAUNCH_SAMPLES), 0
    launch["first_sample"], launch["sample_count"], launch["block_bits"] = 0, samples, block_bits(samples)
    work = TILE_PIXELS * max(samples, 1)
    while done < tiles.size:
        count = min(tiles.size - done, max(FEWEST_TILES, launches.size // work))
        launch["first_pixel"], launch["pixel_count"] = done * TILE_PIXELS, count * TILE_PIXELS
        kernel.set_args(*session.scene_arguments, pixels.buffer, tiles.buffer, launch[0])
        launches.add(session.enqueue(kernel, count * TILE_PIXELS), count * work)
        done += count
    launches.wait()
    values = pixels.read(device).reshape(height, width)
    check_pixels(device, values)
    return values
