"""Statistical tests with p-values, for checking what is random without guessed tolerances.

A p-value is uniform in [0, 1] where the hypothesis holds; a test that rejects below `sidak(alpha, tests)` errs in a
fraction alpha of all runs of `tests` tests.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Numbers = float | NDArray[Any]


def sidak(alpha: float, tests: int) -> float:
    """The significance for each of `tests` independent tests so that all together err with probability alpha."""
    return float(-np.expm1(np.log1p(-alpha) / tests))


def chi2_test(observed: ArrayLike, expected: ArrayLike, min_expected: float = 5.0) -> float:
    """Pearson's chi-square: the p-value of the observed counts of cells, given their expected counts (any shape).

    Both must have the same total: where samples can fail, give the failures a cell. The cells that expect least are
    pooled until every one expects at least `min_expected`. A count where none can be gives 0.
    """
    from scipy.stats import chi2

    counts, means = np.ravel(observed).astype(np.float64), np.ravel(expected).astype(np.float64)
    if np.any(counts[means == 0] > 0):
        return 0.0
    counts, means = _pooled(counts, means, min_expected)
    if means.size < 2:
        raise ValueError(f"too few samples: only {means.size} cells expect {min_expected} or more")
    return float(chi2.sf(np.sum((counts - means) ** 2 / means), means.size - 1))


def mean_test(mean: Numbers, variance: Numbers, count: Numbers, expected: Numbers) -> NDArray[np.float64]:
    """Two-sided z-test: the p-value of each sample mean, given the samples' variance and number, and the true mean.

    Arguments broadcast. `count` must be large enough for the mean to be normal. Where the variance is 0 the p-value is
    1 for the exact mean and 0 for any other.
    """
    from scipy.special import erfc

    error = np.sqrt(np.divide(variance, count, dtype=np.float64))
    difference = np.abs(np.subtract(mean, expected, dtype=np.float64))
    with np.errstate(divide="ignore", invalid="ignore"):
        z = np.where(difference == 0, 0.0, difference / error)
    return np.asarray(erfc(z / np.sqrt(2)), np.float64)


def _pooled(counts: NDArray[np.float64], means: NDArray[np.float64],
            least: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    order = np.argsort(means, kind="stable")
    counts, means = counts[order], means[order]
    # The pool takes every small cell, then the next larger ones until it is large enough itself.
    size = max(int(np.searchsorted(means, least)), 1)
    while size < means.size and means[:size].sum() < least:
        size += 1
    return (np.concatenate(([counts[:size].sum()], counts[size:])),
            np.concatenate(([means[:size].sum()], means[size:])))
