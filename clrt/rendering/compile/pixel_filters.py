"""Quantiles of pixel filters, by which the kernels sample positions in and around a pixel (kernels/film)."""

from __future__ import annotations

from collections.abc import Callable
from math import erf, exp, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from .records import FILTER

Doubles = NDArray[np.float64]
#: Quantiles are tabulated at 0, 1/CELLS … 1; kernels/film/table_filter.cl uses the same number.
CELLS = 1024
#: Bisection steps, after which a quantile is exact to float64 precision.
BISECTIONS = 54


def _tent(t: Doubles) -> Doubles:
    """Return the integral of 1 − |t| from −1."""
    return np.where(t < 0, (1 + t) ** 2 / 2, 1 - (1 - t) ** 2 / 2)


def _blackman_harris(t: Doubles) -> Doubles:
    """Return the normalised integral of the 4-term window with 92 dB (Harris 1978, table 1) over [−1, 1]."""
    a, x = (0.35875, 0.48829, 0.14128, 0.01168), (t + 1) / 2
    waves = sum((-1) ** k * a[k] * np.sin(2 * np.pi * k * x) / (2 * np.pi * k) for k in (1, 2, 3))
    return np.asarray(x + waves / a[0])


def _gaussian(t: Doubles) -> Doubles:
    """Return the normalised integral of exp(−8t²) − exp(−8), a Gaussian truncated to 0 at 4 standard deviations."""
    width, end = sqrt(pi / 32), exp(-8)
    bell = np.vectorize(erf, otypes=[np.float64])(sqrt(8) * t)
    return np.asarray((width * (bell + erf(sqrt(8))) - end * (t + 1)) / (2 * (width * erf(sqrt(8)) - end)))


#: Radius in pixels, and cumulative distribution function over [−1, 1].
FILTERS: dict[str, tuple[float, Callable[[Doubles], Doubles]]] = {
    "tent": (1.0, _tent),
    "blackman_harris": (1.5, _blackman_harris),
    "gaussian": (2.0, _gaussian),
}


def filter_quantiles(name: str) -> NDArray[np.void]:
    """Return (CELLS + 1,) FILTER records of a filter in FILTERS: positions from a pixel's edge, its center at 0.5."""
    radius, distribution = FILTERS[name]
    wanted = np.arange(CELLS + 1) / CELLS
    low, high = np.full(CELLS + 1, -1.0), np.full(CELLS + 1, 1.0)
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        below = distribution(middle) < wanted
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    quantiles = np.zeros(CELLS + 1, FILTER)
    quantiles["quantile"] = 0.5 + radius * high
    return quantiles


def filter_reach(name: str) -> float:
    """Return how far outside its pixel a sample may be taken, in pixels."""
    return FILTERS[name][0] - 0.5 if name in FILTERS else 0.0
