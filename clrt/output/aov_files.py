"""AOVs in image files: layers of an .exr, or separate files."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..aov_types import aov_type, channel_names
from .file_formats import is_shown
from .view_transform import to_display

FloatArray = NDArray[np.float32]
Pictures = Mapping[str, NDArray[np.generic]]

#: Largest integer up to which float32 represents all integers.
LARGEST_ID = 1 << 24
_log = logging.getLogger(__name__)


def layered(pixels: FloatArray, aovs: Pictures) -> tuple[FloatArray, list[str]]:
    """Return all in one array (height, width, n) float32, and the channel names: R, G, B, albedo.R, depth.Z …

    pixels: (height, width, 3), or 4 with associated alpha, the channel A.
    """
    for name, aov in aovs.items():
        if aov.dtype.kind in "iu" and aov.max(initial=0) > LARGEST_ID:
            _log.warning("%s: numbers above %d are rounded in an .exr; Image.aovs has the exact ones", name, LARGEST_ID)
    names = [*"RGBA"[: pixels.shape[2]], *(channel for name in aovs for channel in channel_names(name))]
    layers = [aov.astype(np.float32).reshape(*aov.shape[:2], -1) for aov in aovs.values()]
    return np.concatenate([pixels, *layers], axis=2), names


def files_beside(path: Path, names: Iterable[str]) -> dict[str, Path]:
    """Return the AOVs' paths for an image at `path`: <stem>.<name>.png for a .png, and likewise for other formats with
    a view transform; none for .exr and .hdr."""
    shown = is_shown(path)
    return {name: path.with_name(f"{path.stem}.{name}{path.suffix}") for name in names if shown}


def drawn(name: str, aov: NDArray[np.generic], view: str, exposure: float) -> NDArray[np.uint8]:
    """Return a visualization of an AOV as 8-bit colors (height, width, 3); see docs/aovs.md."""
    values = aov.astype(np.float32).reshape(*aov.shape[:2], -1)
    match aov_type(name).display:
        case "light":
            return to_display(values, view, exposure)
        case "error":
            return to_display(np.sqrt(np.nan_to_num(values)), view, exposure)
        case "color":
            return to_display(np.broadcast_to(values, (*aov.shape[:2], 3)))
        case "direction":
            shown = np.where(values.any(axis=2, keepdims=True), 0.5 + 0.5 * values, 0)
        case "position":
            low, high = values.min(axis=(0, 1)), values.max(axis=(0, 1))
            shown = (values - low) / np.where(high > low, high - low, 1)
        case "depth":
            shown = np.where(np.isfinite(values), values.min(), 0) / values
        case "count":
            shown = values / max(values.max(), 1)
        case "id":
            shown = _colors_of(aov)
        case "matte":
            ids = np.ascontiguousarray(values[..., ::2]).view(np.uint32)
            shown = np.sum(_colors_of(ids) * values[..., 1::2, None], axis=2)
    return to_display(np.broadcast_to(shown, (*aov.shape[:2], 3)).astype(np.float32), "raw")


def _colors_of(ids: NDArray[np.generic]) -> NDArray[np.floating]:
    """Map each id to a color that differs from those of nearby ids (hues a golden ratio apart); −1 is black."""
    numbers = ids.astype(np.float64)[..., None]
    hues = numbers * ((np.sqrt(5) - 1) / 2) + np.arange(3) / 3
    return np.where(numbers < 0, 0, 0.6 + 0.4 * np.cos(2 * np.pi * hues))
