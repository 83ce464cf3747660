"""The fitted curve is exact for points on it, and agrees with scipy for others."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import linregress

from clrt.bench.rays.line_fit import fit_logarithm

RNG = np.random.default_rng(4)
SIZES = [10_000, 31_623, 100_000, 316_228, 1_000_000, 10_000_000]


def test_points_on_a_curve_give_it_back() -> None:
    fit = fit_logarithm([2, 8, 32, 1024], [5 + 3 * n for n in (1, 3, 5, 10)])
    assert fit == {"a": pytest.approx(5), "b": pytest.approx(3), "r2": pytest.approx(1)}
    assert fit_logarithm([2, 4, 8], [7e-8] * 3) == {"a": pytest.approx(7e-8), "b": 0, "r2": 1}


def test_noise_is_fitted_as_scipy_does() -> None:
    """Values are of the size of seconds per ray, with sums of squares near 1e-16."""
    seconds = 2e-8 + 1e-8 * np.log2(SIZES) + RNG.normal(0, 3e-8, len(SIZES))
    expected = linregress(np.log2(SIZES), seconds)
    fit = fit_logarithm(SIZES, seconds)
    assert (fit["a"], fit["b"], fit["r2"]) == pytest.approx((expected.intercept, expected.slope, expected.rvalue**2))
    assert 0.1 < fit["r2"] < 0.99
