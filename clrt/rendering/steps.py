"""Tables of steps: a choice with given probabilities that keeps the order of the random numbers it is made by."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .records import SKY_STEP

#: Of the kernels' random numbers, which are multiples of its inverse.
LEVELS = 1 << 24


def steps(weights: NDArray[np.float64]) -> tuple[NDArray[np.void], NDArray[np.float64]]:
    """SKY_STEPs (..., n) and probabilities (..., n) for weights (..., n) >= 0, each row with a positive sum.

    Step i ends at `top`, the share of all weights up to its own, rounded to 1/LEVELS: then numbers of 24 bits fall into
    it exactly as often as its probability says, the difference of two tops. `start`: the step into which i/n falls
    (Chen and Asau 1974, "On Generating Random Variates from an Empirical Distribution").
    """
    n = weights.shape[-1]
    total = np.cumsum(weights, axis=-1)
    tops = np.round(total / total[..., -1:] * LEVELS)
    table = np.zeros(weights.shape, SKY_STEP)
    table["top"] = tops / LEVELS
    # The first i/n at or beyond each step's end; 1/LEVELS more, since the kernels' product u·n may be rounded up.
    rows = np.arange(tops.size // n)[:, None] * (n + 1)
    first = np.minimum(np.ceil((tops.reshape(-1, n) + 1) * (n / LEVELS)).astype(np.int64), n)
    before = np.bincount((rows + first).ravel(), minlength=rows.size * (n + 1)).reshape(-1, n + 1)[:, :n]
    table["start"] = np.cumsum(before, axis=1).reshape(weights.shape)
    return table, np.diff(tops, prepend=0, axis=-1) / LEVELS
