"""Statistical tests with p-values, to check random quantities without ad hoc tolerances.

A p-value is uniform in [0, 1] under the null hypothesis; rejecting below `sidak(alpha, tests)` gives a false alarm in a
fraction alpha of all runs of `tests` tests.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .numerics.row import Row

Numbers = float | NDArray[Any]

#: False-alarm probability of a family of tests.
FAMILY = 1e-3


def sidak(alpha: float, tests: int) -> float:
    """Return the significance level of each of `tests` independent tests for a joint false-alarm probability alpha."""
    return float(-np.expm1(np.log1p(-alpha) / tests))


def rejected(p_values: Mapping[str, float], alpha: float = FAMILY) -> dict[str, float]:
    """Return the rejected tests of a family; a valid family has any with probability alpha."""
    limit = sidak(alpha, max(1, len(p_values)))
    return {name: p for name, p in p_values.items() if not p >= limit}


def corrected(p: float, tests: int) -> float:
    """Return the corrected p-value of the smallest of `tests`: below alpha if p is below `sidak(alpha, tests)`."""
    return -math.expm1(tests * math.log1p(-p)) if p < 1 else 1.0


def family_row(case: str, what: str, p_values: Mapping[str, float]) -> Row:
    """Count the rejected tests of a family; the figure is the smallest p-value, corrected for their number."""
    least = corrected(min(p_values.values()), len(p_values))
    return Row(case, what, len(p_values), len(rejected(p_values)), least, "least p, corrected")


def chi2_test(observed: ArrayLike, expected: ArrayLike, min_expected: float = 5.0) -> float:
    """Pearson's chi-square test: return the p-value of cells' observed counts, given their expected counts (any shape).

    Both must have the same total: if samples can fail, the failures need a cell. The cells that expect least are pooled
    until every one expects at least `min_expected`. A nonzero count in a cell that expects 0 gives 0.
    """
    counts, means = np.ravel(observed).astype(np.float64), np.ravel(expected).astype(np.float64)
    if np.any(counts[means == 0] > 0):
        return 0.0
    counts, means = _pooled(counts, means, min_expected)
    if means.size < 2:
        raise ValueError(f"too few samples: only {means.size} cells expect {min_expected} or more")
    return _upper_gamma((means.size - 1) / 2, float(np.sum((counts - means) ** 2 / means)) / 2)


def mean_test(mean: Numbers, variance: Numbers, count: Numbers, expected: Numbers) -> NDArray[np.float64]:
    """Two-sided z-test: return the p-value of sample means, given the samples' variance and number, and true mean.

    Arguments broadcast. `count` must be large enough for the mean to be normal. For zero variance the p-value is 1 if
    the mean is exact and 0 otherwise.
    """
    error = np.sqrt(np.divide(variance, count, dtype=np.float64))
    difference = np.abs(np.subtract(mean, expected, dtype=np.float64))
    with np.errstate(divide="ignore", invalid="ignore"):
        z = np.where(difference == 0, 0.0, difference / error)
    return np.asarray(np.vectorize(math.erfc, otypes=[np.float64])(z / np.sqrt(2)))


def t_test(t: float, freedom: float) -> float:
    """Two-sided t-test: return the p-value of t (mean over standard error) for `freedom` >= 1 degrees of freedom.

    With t = √freedom·tan θ its density is proportional to cos^(freedom − 1) θ, integrated from θ over the total.
    """
    nodes, weights = _gauss()

    def above(start: float) -> float:
        width = math.pi / 2 - start
        return float(np.sum(weights * np.sin(width * (1 - nodes) / 2) ** (freedom - 1))) * width

    return above(math.atan(abs(t) / math.sqrt(freedom))) / above(0.0)


@cache
def _gauss() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    nodes, weights = np.polynomial.legendre.leggauss(256)
    return nodes, weights


def _pooled(
    counts: NDArray[np.float64], means: NDArray[np.float64], least: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    order = np.argsort(means, kind="stable")
    counts, means = counts[order], means[order]
    # The pool takes every small cell, then the next larger ones until it is large enough itself.
    size = max(int(np.searchsorted(means, least)), 1)
    while size < means.size and means[:size].sum() < least:
        size += 1
    return (
        np.concatenate(([counts[:size].sum()], counts[size:])),
        np.concatenate(([means[:size].sum()], means[size:])),
    )


def _upper_gamma(a: float, x: float) -> float:
    """Return Q(a, x) = Γ(a, x)/Γ(a): a series below x = a + 1, else a continued fraction (Press et al. 2007, 6.2)."""
    if x <= 0:
        return 1.0
    front = math.exp(a * math.log(x) - x - math.lgamma(a))
    if x < a + 1:
        term = total = 1 / a
        n = a
        while term > total * 1e-16:
            n += 1
            term *= x / n
            total += term
        return 1 - front * total
    b = x + 1 - a
    c, d = math.inf, 1 / b
    fraction, i, change = d, 0, 0.0
    while abs(change - 1) > 1e-15:
        i += 1
        step, b = i * (a - i), b + 2
        d = 1 / (step * d + b)
        c = b + step / c
        change = c * d
        fraction *= change
    return front * fraction
