"""What is expected of a pixel, as far as a noisy picture tells: errors are divided by it (Film.relative_to)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]
#: Pixels on each side of the narrower and of the wider of two windows.
NEAR, REACH = 2, 8
#: The pixels around one in the narrower.
NEAREST = (2 * NEAR + 1) ** 2 - 1


def expected(mean: Doubles, variance: Doubles) -> Doubles:
    """(height, width, 3): of pixels whose surroundings are there, too.

    mean, variance: (height + 2 REACH, width + 2 REACH, 3), of the pixels and of those around them.

    It is the mean of the 288 pixels around it, from there on towards that of the 24 nearest and then towards its own,
    each as far as variance cannot explain the difference (James and Stein 1961). So a pixel that is bright by chance
    does not count itself, nor do its neighbours alone, and one beside an edge is not mixed with what is behind that.
    """
    own, own_variance = mean[REACH:-REACH, REACH:-REACH], variance[REACH:-REACH, REACH:-REACH]
    far, far_variance = _around(mean, own, REACH), _around(variance, own_variance, REACH)
    near, near_variance = _around(mean, own, NEAR), _around(variance, own_variance, NEAR)
    return _towards(_towards(far, near, np.maximum(near_variance, far_variance) / NEAREST), own, own_variance)


def _around(values: Doubles, own: Doubles, reach: int) -> Doubles:
    """Means of the windows around each pixel, without its `own` value; `values` lie REACH beyond these on all sides."""
    within = slice(REACH - reach, len(values) - REACH + reach)
    across = slice(REACH - reach, values.shape[1] - REACH + reach)
    span = 2 * reach + 1
    sums = _sums_of(_sums_of(values[within, across], span).swapaxes(0, 1), span).swapaxes(0, 1)
    return (sums - own) / (span**2 - 1)


def _sums_of(values: Doubles, span: int) -> Doubles:
    """Sums of so many (a power of two, and one) in a row along the first axis. No running sum: its rounding would take
    the light of a pixel a million times as bright far along the row."""
    sums, count = values, 1
    while count < span - 1:
        sums = sums[:-count] + sums[count:]
        count *= 2
    return sums[:-1] + values[count:]


def _towards(start: Doubles, end: Doubles, variance: Doubles) -> Doubles:
    """From `start` towards `end`, of which `variance` is known; not at all where it is NaN."""
    difference = end - start
    with np.errstate(divide="ignore", invalid="ignore"):
        return start + np.fmax(1 - variance / difference**2, 0) * difference
