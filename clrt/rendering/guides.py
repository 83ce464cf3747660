"""Pictures that guide a denoiser: what the camera sees without its light, through mirrors and glass, too."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .accumulation import Accumulation
from .pixels import render_pixels
from .records import GUIDE

#: Camera rays a pixel. More cost a denoiser's user more than they bring (docs/denoise.md).
SAMPLES = 8


def render_guides(session: Accumulation, samples: int = SAMPLES) -> dict[str, NDArray[np.float32]]:
    """The guides of the session's picture by name, each a mean over `samples` camera rays a pixel.

    - albedo (height, width, 3) float32 in [0, 1]: what part of white light the first surface reflects, linear Rec. 709
    - normal (height, width, 3) float32 in [-1, 1]: its shading normal on the camera's side, in the world's frame

    Of mirrors and glass it is what they show. The sky has its radiance, up to 1, for albedo, and no normal. KernelError
    and DeviceError where the device fails.
    """
    values = render_pixels(session, session.compiled.source_of("guides.cl"), "guides", GUIDE, samples)
    return {name: np.ascontiguousarray(values[name]) for name in GUIDE.names or () if not name.startswith("pad")}
