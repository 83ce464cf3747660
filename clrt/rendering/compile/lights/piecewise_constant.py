"""Tables of piecewise-constant distributions, sampled by inversion, which preserves the order of the random numbers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...film.row_bands import bands_of

#: The kernels' random numbers are multiples of 1/LEVELS.
LEVELS = 1 << 24


def steps(weights: NDArray[np.float64], table: NDArray[np.void]) -> NDArray[np.float64]:
    """Fill a table of SKY_STEPs (rows, n) for weights (rows, n) >= 0, each row with a positive sum; return their
    probabilities (rows, n).

    Step i ends at `top`, the share of all weights up to its own, rounded to 1/LEVELS: then random numbers of 24 bits
    select it exactly with its probability, the difference of two tops. `start`: the step that contains i/n (Chen and
    Asau 1974, "On Generating Random Variates from an Empirical Distribution").
    """
    probabilities = np.empty(weights.shape)
    for rows in bands_of(weights.shape):
        tops = np.cumsum(weights[rows], axis=1)
        tops /= tops[:, -1:].copy()
        tops *= LEVELS
        np.round(tops, out=tops)
        table["top"][rows] = tops / LEVELS
        table["start"][rows] = _starts(tops)
        probabilities[rows] = np.diff(tops, prepend=0, axis=1) / LEVELS
    return probabilities


def _starts(tops: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return (rows, n): for each i the step that contains i/n."""
    count, n = tops.shape
    # The first i/n at or after each step's end; 1/LEVELS more, since the kernels' product u·n may be rounded up.
    first = np.minimum(np.ceil((tops + 1) * (n / LEVELS)).astype(np.intp), n)
    first += np.arange(count)[:, None] * (n + 1)
    before = np.bincount(first.ravel(), minlength=count * (n + 1)).reshape(count, n + 1)
    return np.cumsum(before[:, :n], axis=1)
