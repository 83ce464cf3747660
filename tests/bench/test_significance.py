"""The statistical tests have correct p-values under the null hypothesis, and power against alternatives."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chisquare, kstest, norm, t

from clrt.bench.significance import FAMILY, chi2_test, corrected, family_row, mean_test, rejected, sidak, t_test

CELLS = np.array([0.3, 0.2, 0.2, 0.1, 0.1, 0.06, 0.04])


def test_chi2_is_pearsons() -> None:
    observed, expected = [44, 56, 61, 39], [50, 50, 60, 40]
    assert chi2_test(observed, expected) == pytest.approx(chisquare(observed, expected).pvalue, rel=1e-12)


@pytest.mark.parametrize(
    "observed, expected, pooled_observed, pooled_expected",
    [
        # 1 + 2 < 5, so the next larger cell, 10, joins the pool.
        ([3, 0, 9, 30, 58], [1, 2, 10, 27, 60], [12, 30, 58], [13, 27, 60]),
        # 2 + 4 is enough by itself, and order does not matter.
        ([60, 3, 30, 7], [64, 4, 30, 2], [10, 30, 60], [6, 30, 64]),
        # Cells with expectation and count 0 are no evidence.
        ([40, 0, 60], [50, 0, 50], [40, 60], [50, 50]),
    ],
)
def test_chi2_pools_rare_cells(
    observed: list[int], expected: list[int], pooled_observed: list[int], pooled_expected: list[int]
) -> None:
    by_hand = chisquare(pooled_observed, pooled_expected).pvalue
    assert chi2_test(observed, expected) == pytest.approx(by_hand, rel=1e-12)


def test_chi2_rejects_a_count_where_none_can_be() -> None:
    assert chi2_test([500, 1, 499], [500, 0, 500]) == 0


def test_chi2_refuses_too_few_samples() -> None:
    with pytest.raises(ValueError, match="too few samples"):
        chi2_test([1, 2, 1], [1, 2, 1])


def test_chi2_p_values_are_uniform_under_the_hypothesis() -> None:
    rng = np.random.default_rng(1)
    p = [chi2_test(rng.multinomial(5000, CELLS), 5000 * CELLS) for _ in range(2000)]
    assert kstest(p, "uniform").pvalue > 0.001


def test_chi2_rejects_another_distribution() -> None:
    other = CELLS + np.array([0, 0, 0, 0, 0, 0.01, -0.01])
    assert chi2_test(np.random.default_rng(2).multinomial(50000, other), 50000 * CELLS) < 1e-10


@pytest.mark.parametrize("cells", [2, 3, 20, 1000, 20000])
def test_chi2_p_values_over_their_whole_range(cells: int) -> None:
    """Covers p-values from nearly 1 to 1e-280, with few and many degrees of freedom; scipy is the reference."""
    expected = np.full(cells, 1000.0)
    for spread in (0.2, 0.7, 0.95, 1.0, 1.05, 1.3, 3.0):
        observed = expected + np.where(np.arange(cells) % 2, 1, -1) * np.sqrt(1000 * spread * (cells - 1) / cells)
        by_scipy = chisquare(observed, expected, sum_check=False).pvalue
        if by_scipy > 1e-280:
            assert chi2_test(observed, expected) == pytest.approx(by_scipy, rel=1e-9)


def test_mean_p_values_are_uniform_under_the_hypothesis() -> None:
    samples = np.random.default_rng(3).exponential(2.0, (1500, 4000))
    p = mean_test(samples.mean(1), samples.var(1, ddof=1), 4000, 2.0)
    assert p.shape == (1500,)
    assert kstest(p, "uniform").pvalue > 0.001


@pytest.mark.parametrize("sigmas", [0.5, 1.96, 5.0, 20.0])
def test_mean_p_value_is_the_normal_tail_on_both_sides(sigmas: float) -> None:
    error = np.sqrt(3.0 / 400)
    for side in (-1, 1):
        assert mean_test(7 + side * sigmas * error, 3.0, 400, 7.0) == pytest.approx(2 * norm.sf(sigmas), rel=1e-9)


def test_mean_without_variance_must_be_exact() -> None:
    assert mean_test(np.array([0.5, 0.5]), 0.0, 16, np.array([0.5, 0.25])).tolist() == [1, 0]


@pytest.mark.parametrize("freedom", [1, 1.7, 2, 4.5, 30, 95.3, 4000])
def test_t_p_values_are_students(freedom: float) -> None:
    for value in (0.0, 0.3, -1.0, 4.0, 9.0):
        assert t_test(value, freedom) == pytest.approx(2 * t.sf(abs(value), freedom), rel=1e-9)


@pytest.mark.parametrize("tests", [1, 7, 10**6])
def test_sidak_keeps_the_error_of_all_tests_together(tests: int) -> None:
    assert 1 - (1 - sidak(0.01, tests)) ** tests == pytest.approx(0.01, rel=1e-6)


def test_corrected_p_values_are_sidaks() -> None:
    assert corrected(sidak(FAMILY, 15), 15) == pytest.approx(FAMILY)
    assert corrected(1.0, 3) == 1 and corrected(0.0, 3) == 0


def test_a_family_rejects_those_below_its_own_significance() -> None:
    p_values = {"right": 0.4, "by chance": 2e-4, "wrong": 1e-5, "no number": float("nan")}
    assert set(rejected(p_values)) == {"by chance", "wrong", "no number"}
    assert set(rejected(p_values, 1e-4)) == {"wrong", "no number"}
    assert not rejected({})


def test_a_row_tells_the_least_p_value_corrected() -> None:
    row = family_row("L2", "a family", {"a": 0.5, "b": 1e-3, "c": 0.2})
    assert (row.count, row.wrong) == (3, 0) and row.figure == pytest.approx(1 - 0.999**3)
    assert family_row("L2", "a family", {"a": 1e-5, "b": 1.0}).wrong == 1
    assert family_row("L2", "a family", {"a": 1.0}).figure == 1 and family_row("L2", "", {"a": 0.0}).figure == 0
