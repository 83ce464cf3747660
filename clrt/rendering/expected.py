"""What is expected of a pixel, as far as a noisy picture tells: errors are divided by it (Film.relative_to)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]
Floats = NDArray[np.floating[Any]]
#: Pixels on each side of the narrower and of the wider of two windows: powers of two.
NEAR, REACH = 2, 8
#: The pixels around one in the narrower.
NEAREST = (2 * NEAR + 1) ** 2 - 1
#: Of so much light single precision holds the sum of the squares over a window.
SINGLE_MOST = 1e18


def expected(mean: Doubles, variance: Doubles) -> Doubles:
    """(height, width, 3): of pixels whose surroundings are there, too.

    mean, variance: (height + 2 REACH, width + 2 REACH, 3), of the pixels and of those around them.

    It is the mean of the 288 pixels around it, from there on towards that of the 24 nearest and then towards its own,
    each as far as variance cannot explain the difference (James and Stein 1961). So a pixel that is bright by chance
    does not count itself, nor do its neighbours alone, and one beside an edge is not mixed with what is behind that.

    The windows are in single precision, of which half as much goes through the caches. The last step is not: a pixel
    that is bright by a single sample differs from those around it by hardly more than that explains.
    """
    scale = max(float(mean.max()) / SINGLE_MOST, 1.0)
    means, variances = (mean / scale).astype(np.float32), (variance / scale**2).astype(np.float32)
    far, near = _around(means, REACH), _around(means, NEAR)
    of_near = np.maximum(_around(variances, NEAR), _around(variances, REACH))
    around = _towards(far, near, of_near / np.float32(NEAREST)) * np.float64(scale)
    whole: Doubles = _towards(around, mean[REACH:-REACH, REACH:-REACH], variance[REACH:-REACH, REACH:-REACH])
    return whole


def _around(values: Floats, reach: int) -> Floats:
    """Means of the windows around each pixel, without the pixel itself. It is never added, and there is no running
    sum: what is taken away again leaves its rounding, more than all light around a pixel a million times as bright."""
    column = _beside(values, reach)
    window = _beside((column + values[REACH:-REACH]).swapaxes(0, 1), reach).swapaxes(0, 1)
    window += column[:, REACH:-REACH]
    window /= (2 * reach + 1) ** 2 - 1
    return window


def _beside(values: Floats, reach: int) -> Floats:
    """Sums of the `reach` rows above and below each but the REACH first and last."""
    sums, count = values, 1
    while count < reach:
        sums = sums[:-count] + sums[count:]
        count *= 2
    height = len(values) - 2 * REACH
    return sums[REACH - reach:][:height] + sums[REACH + 1:][:height]


def _towards(start: Floats, end: Floats, variance: Floats) -> Any:
    """From `start` towards `end`, of which `variance` is known; not at all where it is NaN."""
    with np.errstate(divide="ignore", invalid="ignore"):
        by_chance = np.fmin(variance / (end - start) ** 2, 1)
    return by_chance * start + (1 - by_chance) * end
