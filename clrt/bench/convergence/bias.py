"""Bias test: each channel's mean over many images, against that of a reference with known errors.

The error of an image's mean is estimated from the spread over seeds only: pixel errors are correlated, especially with
good samplers. The reference's error is estimated likewise, from the spread of its steps.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..significance import FAMILY, corrected, t_test

#: Relative error of a mean that float32 rounding along a path may cause, independent of the number of samples.
ROUNDING = 1e-6

Doubles = NDArray[np.float64]


def mean_tests(ratios: Mapping[str, Doubles], steps: Doubles) -> dict[str, dict[str, Any]]:
    """Return `z` and `p` per channel for each contestant, and whether it is `biased`.

    ratios: (seeds, channels) of a contestant, the means of its images over the reference's; steps: (n, channels), the
    means of the images that the reference is the mean of. z: by how many standard errors the mean ratio exceeds 1;
    p: two-sided by Student's t, corrected for all contestants and channels (Šidák 1967: also valid for correlated
    normal errors); biased if any p is below FAMILY. NaN: a black channel or a single seed.
    """
    tests = {name: _compared(rows, steps) for name, rows in ratios.items()}
    count = sum(isfinite(z) for pairs in tests.values() for z, _ in pairs)
    rows = {}
    for name, pairs in tests.items():
        p_values = [corrected(t_test(z, freedom), count) if isfinite(z) else z for z, freedom in pairs]
        rows[name] = {"z": [z for z, _ in pairs], "p": p_values, "biased": any(p < FAMILY for p in p_values)}
    return rows


def _compared(ratios: Doubles, steps: Doubles) -> list[tuple[float, float]]:
    """Return z and its degrees of freedom per channel: those of the smaller sample.

    With these, Student's t is conservative whatever the variances (Mickey and Brown 1966). Welch's are not with few
    seeds: two that agree by chance would count as an error that is known exactly.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        own = _squared_error(ratios) + ROUNDING**2
        other = _squared_error(steps) / steps.mean(0) ** 2
        z = (ratios.mean(0) - 1) / np.sqrt(own + other)
        freedom = np.where(other > 0, min(len(ratios), len(steps)), len(ratios)) - 1.0
    return list(zip(z.tolist(), freedom.tolist()))


def _squared_error(rows: Doubles) -> Doubles:
    """Return the squared standard error of the mean of rows (n, channels); NaN for one row."""
    return np.asarray(rows.var(0) / (len(rows) - 1) if len(rows) > 1 else np.full(rows.shape[1], np.nan))
