"""View transforms: linear Rec. 709 radiance to the 8 bits of a display.

Every view takes (h, w, 3) float32 in [0, 1e15] and returns the display's signal, which is then cut to [0, 1].
To add one: write its function and list it in VIEWS.
"""

from __future__ import annotations

from collections.abc import Callable
from difflib import get_close_matches

import numpy as np
from numpy.typing import NDArray

from ..errors import UsageError

FloatArray = NDArray[np.float32]

#: The luminance that "reinhard" shows as white: four stops above 1.
REINHARD_WHITE = 16.0
#: Brighter is shown as this: far beyond any display, and its square still fits into float32.
BRIGHTEST = 1e15


def srgb(linear: FloatArray) -> FloatArray:
    """The sRGB curve (IEC 61966-2-1), linear near black."""
    linear = np.minimum(linear, np.float32(1))
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def raw(linear: FloatArray) -> FloatArray:
    """No curve: for masks, normals and other data."""
    return linear


def reinhard(linear: FloatArray) -> FloatArray:
    """Compress luminance so that REINHARD_WHITE becomes 1, keeping the ratios of the channels; then the sRGB curve.

    Reinhard et al. 2002, Photographic Tone Reproduction for Digital Images, eq. 4.
    """
    luminance = linear @ np.array([0.2126, 0.7152, 0.0722], np.float32)
    scale = (1 + luminance / np.float32(REINHARD_WHITE**2)) / (1 + luminance)
    return srgb(linear * scale[..., np.newaxis])


VIEWS: dict[str, Callable[[FloatArray], FloatArray]] = {"srgb": srgb, "raw": raw, "reinhard": reinhard}


def check_view(name: str) -> None:
    """Raise UsageError unless there is a view of this name."""
    if name not in VIEWS:
        meant = "".join(f"; did you mean {match}?" for match in get_close_matches(name, VIEWS, 1))
        raise UsageError(f"no view transform {name!r}; there are {', '.join(VIEWS)}{meant}")


def to_display(pixels: FloatArray, view: str = "srgb", exposure: float = 0.0) -> NDArray[np.uint8]:
    """(h, w, 3) float32 linear to uint8 of the same shape, after a gain of 2**exposure.

    NaN and negative values become 0, +Inf 255; the rest is rounded to nearest, halves up, without dithering.
    Raises UsageError for an unknown view.
    """
    check_view(view)
    with np.errstate(over="ignore", invalid="ignore"):
        exposed = pixels * np.exp2(np.float32(exposure))
    linear = np.clip(np.nan_to_num(exposed, nan=0.0, posinf=BRIGHTEST), np.float32(0), np.float32(BRIGHTEST))
    signal: FloatArray = np.clip(VIEWS[view](linear), 0, 1)
    levels: FloatArray = np.floor(255 * signal + np.float32(0.5))
    return levels.astype(np.uint8)
