"""Estimate of the expected pixel values of a noisy image, which errors are divided by (Film.relative_to)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]
Floats = NDArray[np.floating[Any]]
#: Radii in pixels of the smaller and the larger of two windows: powers of two.
NEAR, REACH = 2, 8
#: Number of neighbours in the smaller window.
NEAREST = (2 * NEAR + 1) ** 2 - 1
#: Maximum radiance for which single precision holds the sum of squares over a window.
SINGLE_MOST = 1e18


def expected(mean: Doubles, variance: Doubles) -> Doubles:
    """Return (height, width, 3), estimates for the pixels that have a full neighbourhood.

    mean, variance: (height + 2 REACH, width + 2 REACH, 3), of the pixels and of those around them.

    The estimate is the mean of the 288 surrounding pixels, moved towards that of the nearest 24 and then towards the
    pixel's own value, each time by the part of the difference that variance does not explain (James and Stein 1961). So
    a pixel that is bright by chance does not count itself, nor do its neighbours alone, and a pixel at an edge is not
    mixed with what lies beyond it.

    The windows are in single precision, which halves the cache traffic. The last step is not: a pixel that is bright
    due to a single sample differs from its neighbours by hardly more than its variance explains.
    """
    scale = max(float(mean.max()) / SINGLE_MOST, 1.0)
    means, variances = (mean / scale).astype(np.float32), (variance / scale**2).astype(np.float32)
    far, near = _around(means, REACH), _around(means, NEAR)
    of_near = np.maximum(_around(variances, NEAR), _around(variances, REACH))
    around = _towards(far, near, of_near / np.float32(NEAREST)) * np.float64(scale)
    whole: Doubles = _towards(around, mean[REACH:-REACH, REACH:-REACH], variance[REACH:-REACH, REACH:-REACH])
    return whole


def _around(values: Floats, reach: int) -> Floats:
    """Return the means of the windows around each pixel, excluding the pixel itself. It is never added, and there is no
    running sum: subtracting it again would leave a rounding error larger than all light around a pixel that is a
    million times as bright."""
    column = _beside(values, reach)
    window = _beside((column + values[REACH:-REACH]).swapaxes(0, 1), reach).swapaxes(0, 1)
    window += column[:, REACH:-REACH]
    window /= (2 * reach + 1) ** 2 - 1
    return window


def _beside(values: Floats, reach: int) -> Floats:
    """Return sums of the `reach` rows above and below each row, except for the first and last REACH rows."""
    sums, count = values, 1
    while count < reach:
        sums = sums[:-count] + sums[count:]
        count *= 2
    height = len(values) - 2 * REACH
    return sums[REACH - reach :][:height] + sums[REACH + 1 :][:height]


def _towards(start: Floats, end: Floats, variance: Floats) -> Any:
    """Shrink `end`, of known variance, towards `start`; return `start` where the variance is NaN."""
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        by_chance = np.fmin(variance / (end - start) ** 2, 1)
    return by_chance * start + (1 - by_chance) * end
