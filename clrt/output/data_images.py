"""Display in a .png of images that are not radiance: normals and depths. An .exr contains the values themselves."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..errors import UsageError

FloatArray = NDArray[np.float32]


def _normals(pixels: FloatArray) -> FloatArray:
    """Map normals to ½ + ½·n, as in normal maps; black where there is none."""
    return np.where(pixels.any(axis=2, keepdims=True), np.float32(0.5) + np.float32(0.5) * pixels, np.float32(0))


def _depth(pixels: FloatArray) -> FloatArray:
    """Map depths to the nearest depth over each, so white is nearest; black where nothing was hit."""
    seen = pixels > 0
    nearest = pixels.min(where=seen, initial=np.inf)
    return np.asarray(np.divide(nearest, pixels, out=np.zeros_like(pixels), where=seen))


_SHOWN: dict[str, Callable[[FloatArray], FloatArray]] = {"normals": _normals, "depth": _depth}


def shown_data(integrator: str, pixels: FloatArray) -> FloatArray | None:
    """Return what a .png shows of (height, width, 3) pixels, without view or exposure; None for color images."""
    return _SHOWN[integrator](pixels) if integrator in _SHOWN else None


def check_denoisable(integrator: str) -> None:
    """Raise UsageError unless images of this integrator are colors, which denoisers require."""
    if integrator in _SHOWN:
        raise UsageError(f"denoising is for colour images, and the integrator is {integrator}; leave one of them out")
