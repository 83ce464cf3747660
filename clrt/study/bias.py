"""Whether renderers are unbiased: each channel's mean over many pictures, against that of a reference with errors.

A picture's mean is known from the spread over seeds alone: pixels' errors are not independent, those of good samplers
least of all. The same goes for the reference's, by its steps.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .significance import FAMILY, corrected, t_test

#: Of a mean; so much of it float32 may shift along a path, however many samples there are.
ROUNDING = 1e-6

Doubles = NDArray[np.float64]


def mean_tests(ratios: Mapping[str, Doubles], steps: Doubles) -> dict[str, dict[str, Any]]:
    """Of each contestant `z` and `p`, by channel, and whether it is `biased`.

    ratios: (seeds, channels) of a contestant, the means of its pictures over the reference's; steps: (n, channels), the
    means of the pictures that the reference is the mean of. z: by how many standard errors the mean ratio is above 1;
    p: two-sided by Student's t with Welch's degrees of freedom, corrected for all contestants and channels (Šidák 1967:
    also for normal errors that are not independent); biased where one is below FAMILY. NaN: a black channel, one seed.
    """
    tests = {name: _welch(rows, steps) for name, rows in ratios.items()}
    count = sum(isfinite(z) for pairs in tests.values() for z, _ in pairs)
    rows = {}
    for name, pairs in tests.items():
        p_values = [corrected(t_test(z, freedom), count) if isfinite(z) else z for z, freedom in pairs]
        rows[name] = {"z": [z for z, _ in pairs], "p": p_values, "biased": any(p < FAMILY for p in p_values)}
    return rows


def _welch(ratios: Doubles, steps: Doubles) -> list[tuple[float, float]]:
    """z and its degrees of freedom (Welch 1947), by channel."""
    with np.errstate(invalid="ignore", divide="ignore"):
        own = _squared_error(ratios) + ROUNDING**2
        other = _squared_error(steps) / steps.mean(0) ** 2
        z = (ratios.mean(0) - 1) / np.sqrt(own + other)
        freedom = (own + other) ** 2 / (own**2 / (len(ratios) - 1) + other**2 / (len(steps) - 1))
    return list(zip(z.tolist(), freedom.tolist()))


def _squared_error(rows: Doubles) -> Doubles:
    """Of the mean of rows (n, channels); NaN of one."""
    return np.asarray(rows.var(0) / (len(rows) - 1) if len(rows) > 1 else np.full(rows.shape[1], np.nan))
