"""Guide images for a denoiser: albedo and normal of what the camera sees, also through mirrors and glass."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compile.records import GUIDE
from .accumulation import Accumulation
from .per_pixel_kernel import per_pixel_kernel, render_pixels

#: Camera rays per pixel. More cost more than they improve the denoised image (docs/denoise.md).
SAMPLES = 8


def render_guides(session: Accumulation, samples: int = SAMPLES) -> dict[str, NDArray[np.float32]]:
    """Return the guides of the session's image by name, each a mean over `samples` camera rays per pixel.

    - albedo (height, width, 3) float32 in [0, 1]: albedo of the first surface under white light, linear Rec. 709
    - normal (height, width, 3) float32 in [-1, 1]: its shading normal on the camera's side, in world space

    At mirrors and glass they are those of what is seen in them. The sky's albedo is its radiance, up to 1; it has no
    normal. Raises KernelError and DeviceError if the device fails.
    """
    kernel = per_pixel_kernel(
        session, "guides", "guides", lambda: (session.compiled.source_of("aov/denoiser_guides.cl"), GUIDE)
    )
    values = render_pixels(session, kernel, samples)
    return {name: np.ascontiguousarray(values[name]) for name in GUIDE.names or () if not name.startswith("pad")}
