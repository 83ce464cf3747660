"""View transforms: linear Rec. 709 radiance to the 8 bits of a display (docs/colour.md).

Every view takes (h, w, 3) float32 in [0, 1e15] and returns the display's signal, which is then clamped to [0, 1].
To add one: write its function and list it in VIEWS.
"""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import UsageError, did_you_mean
from .ocio import ACES, ocio_view

FloatArray = NDArray[np.float32]
View = Callable[[FloatArray], FloatArray]
#: Kinds of integers that levels are stored as.
Level = type[np.uint8] | type[np.uint16]

#: The luminance that "reinhard" maps to white: four stops above 1.
REINHARD_WHITE = 16.0
#: Upper clamp of the input: far beyond any display, and its square still fits float32.
BRIGHTEST = 1e15
#: Rows processed at a time; larger temporary arrays are allocated from the system each time, which is slower.
ROWS = 16
#: "agx": Rec. 709 with its primaries moved towards white, and the values that map to 0 and 1, as binary logarithms.
AGX_INSET = np.array(
    [
        [0.842479062253094, 0.0784335999999992, 0.0792237451477643],
        [0.0423282422610123, 0.878468636469772, 0.0791661274605434],
        [0.0423756549057051, 0.0784336, 0.879142973793104],
    ],
    np.float32,
)
AGX_DARKEST, AGX_BRIGHTEST = -12.47393, 4.026069
#: The curve's pivot, its steepest point: middle grey, 10 stops below and 6.5 above; its slope; toe and shoulder power.
AGX_PIVOT, AGX_SLOPE, AGX_TOE, AGX_SHOULDER = (10 / 16.5, 0.5), 2.0, 3.0, 3.25
#: "pbr_neutral": start of the compression; how fast brighter colors desaturate; Fresnel offset.
NEUTRAL_START, NEUTRAL_DESATURATION, NEUTRAL_OFFSET = 0.8 - 0.04, 0.15, 0.04


def srgb(linear: FloatArray) -> FloatArray:
    """Apply the sRGB curve (IEC 61966-2-1), linear near black."""
    linear = np.minimum(linear, np.float32(1))
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def raw(linear: FloatArray) -> FloatArray:
    """Apply no curve: for masks, normals and other data."""
    return linear


def reinhard(linear: FloatArray) -> FloatArray:
    """Compress luminance so that REINHARD_WHITE becomes 1, keeping the channels' ratios; then apply the sRGB curve.

    Reinhard et al. 2002, Photographic Tone Reproduction for Digital Images, eq. 4.
    """
    luminance = linear @ np.array([0.2126, 0.7152, 0.0722], np.float32)
    scale = (1 + luminance / np.float32(REINHARD_WHITE**2)) / (1 + luminance)
    return srgb(linear * scale[..., np.newaxis])


def agx(linear: FloatArray) -> FloatArray:
    """Apply AgX Base: bright colors desaturate to white as on film (Sobotka, github.com/sobotka/AgX).

    The published config contains the curve as a table of 4096 values; this is the function that generated it.
    """
    stops = np.log2(np.maximum(linear @ AGX_INSET.T, np.float32(2**AGX_DARKEST)))
    x = np.clip((stops - AGX_DARKEST) / (AGX_BRIGHTEST - AGX_DARKEST), 0, 1).astype(np.float32)
    return np.where(
        x < AGX_PIVOT[0],
        0.5 - _agx_half(AGX_PIVOT[0] - x, *AGX_PIVOT, AGX_TOE),
        0.5 + _agx_half(x - AGX_PIVOT[0], 1 - AGX_PIVOT[0], 1 - AGX_PIVOT[1], AGX_SHOULDER),
    )


def _agx_half(away: FloatArray, width: float, height: float, power: float) -> FloatArray:
    """Evaluate the curve at a distance `away` from the pivot: a hyperbola that is `height` at `width`."""
    scale = ((AGX_SLOPE * width) ** -power * ((AGX_SLOPE * width / height) ** power - 1)) ** (-1 / power)
    term = AGX_SLOPE * np.maximum(away, 0) / scale
    return np.asarray(scale * term / (1 + term**power) ** (1 / power), np.float32)


def pbr_neutral(linear: FloatArray) -> FloatArray:
    """Keep base colors unchanged, compress brighter ones towards white; then apply the sRGB curve.

    Khronos PBR Neutral (github.com/KhronosGroup/ToneMapping).
    """
    least = linear.min(axis=-1, keepdims=True)
    color = linear - np.where(least < 2 * NEUTRAL_OFFSET, least - least**2 / (4 * NEUTRAL_OFFSET), NEUTRAL_OFFSET)
    peak = color.max(axis=-1, keepdims=True)
    room = 1 - NEUTRAL_START
    over = np.maximum(peak, NEUTRAL_START)
    new_peak = 1 - room**2 / (over + room - NEUTRAL_START)
    whiteness = 1 - 1 / (NEUTRAL_DESATURATION * (over - new_peak) + 1)
    bright = color * (new_peak / over) * (1 - whiteness) + new_peak * whiteness
    return srgb(np.where(peak < NEUTRAL_START, color, bright).astype(np.float32))


VIEWS: dict[str, View] = {"srgb": srgb, "agx": agx, "pbr_neutral": pbr_neutral, "reinhard": reinhard, "raw": raw}


def view_called(name: str) -> View:
    """Return the view of this name: of VIEWS, `aces`, or of OpenColorIO (see `ocio`); raises UsageError if unknown."""
    if name in VIEWS:
        return VIEWS[name]
    kind, _, view = name.partition(":")
    if name == "aces":
        return ocio_view(*ACES)
    if kind == "ocio":
        return ocio_view("", view)
    meant = did_you_mean(name, [*VIEWS, "aces"])
    raise UsageError(f"view transform {name!r} is unknown; choose from {', '.join(VIEWS)}, aces and ocio:VIEW{meant}")


def check_view(name: str, exposure: float) -> None:
    """Raise UsageError unless there is a view of this name, and the exposure is a finite number of stops."""
    view_called(name)
    if not isfinite(exposure):
        raise UsageError(f"exposure is {exposure}; it must be a finite number of stops, such as -1.5")


def to_display(pixels: FloatArray, view: str = "srgb", exposure: float = 0.0) -> NDArray[np.uint8]:
    """Convert (h, w, 3) float32 linear to uint8 of the same shape, see `to_levels`."""
    return to_levels(pixels, view, exposure, np.uint8)


def to_levels(pixels: FloatArray, view: str, exposure: float, kind: Level) -> NDArray[Any]:
    """Convert (h, w, 3) float32 linear to unsigned integers of the same shape, after a gain of 2**exposure.

    NaN and negative values become 0, +Inf the largest level; the rest is rounded to nearest, halves up, without
    dithering. Raises UsageError for an unknown view.
    """
    shown, most = view_called(view), np.float32(np.iinfo(kind).max)
    levels = np.empty(pixels.shape, kind)
    for first in range(0, len(pixels), ROWS):
        with np.errstate(over="ignore", invalid="ignore"):
            exposed = pixels[first : first + ROWS] * np.exp2(np.float32(exposure))
        linear = np.clip(np.nan_to_num(exposed, nan=0.0, posinf=BRIGHTEST), np.float32(0), np.float32(BRIGHTEST))
        levels[first : first + ROWS] = np.floor(most * np.clip(shown(linear), 0, 1) + np.float32(0.5))
    return levels


def transparent_levels(pixels: FloatArray, view: str, exposure: float, kind: Level) -> NDArray[Any]:
    """Convert as `to_levels`; pixels with associated alpha (h, w, 4) to levels with unassociated alpha: the view of the
    pixels' color, 0 where nothing is covered, and the alpha itself."""
    if pixels.shape[2] == 3:
        return to_levels(pixels, view, exposure, kind)
    alpha, most = np.clip(np.nan_to_num(pixels[..., 3:]), 0, 1), np.float32(np.iinfo(kind).max)
    color = np.divide(pixels[..., :3], alpha, out=np.zeros_like(pixels[..., :3]), where=alpha > 0)
    levels = np.floor(most * alpha + np.float32(0.5)).astype(kind)
    return np.concatenate([to_levels(color, view, exposure, kind), levels], axis=2)
