"""How a .png shows pictures whose values are no light: normals and depths. An .exr has the values themselves."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..errors import UsageError

FloatArray = NDArray[np.float32]


def _normals(pixels: FloatArray) -> FloatArray:
    """½ + ½·n, as normal maps are stored; black where there is none."""
    return np.where(pixels.any(axis=2, keepdims=True), np.float32(0.5) + np.float32(0.5) * pixels, np.float32(0))


def _depth(pixels: FloatArray) -> FloatArray:
    """The nearest depth over each, so white is nearest; black where there is nothing."""
    seen = pixels > 0
    nearest = pixels.min(where=seen, initial=np.inf)
    return np.asarray(np.divide(nearest, pixels, out=np.zeros_like(pixels), where=seen))


_SHOWN: dict[str, Callable[[FloatArray], FloatArray]] = {"normals": _normals, "depth": _depth}


def shown_data(integrator: str, pixels: FloatArray) -> FloatArray | None:
    """What a .png shows of (height, width, 3) pixels, without any view or exposure; None for pictures of colours."""
    return _SHOWN[integrator](pixels) if integrator in _SHOWN else None


def check_denoisable(integrator: str) -> None:
    """Raise UsageError unless pictures of this integrator are colours, which is all that denoisers know."""
    if integrator in _SHOWN:
        raise UsageError(f"denoising is for colours, and the integrator is {integrator}; leave one of them out")
