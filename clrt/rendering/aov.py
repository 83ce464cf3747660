"""Pictures beside the picture (AOVs): what the camera sees without its light (kernels/aov.cl)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..device.arrays import empty_array, resident
from ..device.launch import Launches
from ..device.program import build, make_kernel
from .records import AOV
from .session import FEWEST_TILES, FIRST_LAUNCH_SAMPLES, Session, block_bits
from .tiles import TILE_PIXELS

#: Camera rays a pixel. More cost a denoiser's user more than they bring (docs/denoise.md).
SAMPLES = 8


def render_aovs(session: Session, samples: int = SAMPLES) -> dict[str, NDArray[np.float32]]:
    """The AOVs of the session's picture by name, each a mean over `samples` camera rays a pixel.

    - albedo (height, width, 3) float32 in [0, 1]: what part of white light the first surface reflects, linear Rec. 709
    - normal (height, width, 3) float32 in [-1, 1]: its shading normal on the camera's side, in the world's frame

    Of mirrors and glass it is what they show. The sky has its radiance, up to 1, for albedo, and no normal. KernelError
    and DeviceError where the device fails.
    """
    device, (width, height) = session.device, session.size
    kernel = make_kernel(device, build(device, session.compiled.source_of("aov.cl")), "aov")
    pixels = empty_array(device, AOV, width * height)
    tiles = resident(device, np.arange(session.tile_samples.size, dtype=np.uint32))
    launch, launches, done = session.launch.copy(), Launches(FIRST_LAUNCH_SAMPLES), 0
    launch["sample_count"], launch["block_bits"] = samples, block_bits(samples)
    while done < tiles.size:
        count = min(tiles.size - done, max(FEWEST_TILES, launches.size // (samples * TILE_PIXELS)))
        launch["first_pixel"], launch["pixel_count"] = done * TILE_PIXELS, count * TILE_PIXELS
        kernel.set_args(*session.scene_arguments, pixels.buffer, tiles.buffer, launch[0])
        launches.add(session.enqueue(kernel, count * TILE_PIXELS), count * TILE_PIXELS * samples)
        done += count
    launches.wait()
    values = pixels.read(device).reshape(height, width)
    return {name: np.ascontiguousarray(values[name]) for name in AOV.names or () if not name.startswith("pad")}
