"""Bias is found if and only if there is some, also with few seeds and noisy references."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import binomtest, t

from clrt.bench.convergence.bias import mean_tests
from clrt.bench.convergence.converge import Effort, figures, take_turns
from clrt.bench.convergence.reference import Reference

from .known import EXACT, TRUTH, sampler

RNG = np.random.default_rng(11)


@pytest.mark.parametrize("seeds", [2, 3, 5, 64])
@pytest.mark.parametrize(("steps", "noise"), [(32, 0.1), (16, 1.0), (3, 3.0)])
def test_families_without_bias_are_rarely_rejected(seeds: int, steps: int, noise: float) -> None:
    """Over 2000 runs without bias, p is below 0.05 in at most one of twenty, and below 0.001 in one of a thousand."""
    p_values = []
    for _ in range(2000):
        reference = 1 + 1e-3 * noise * RNG.normal(size=(steps, 1))
        ratios = (1 + 1e-3 * RNG.normal(size=(seeds, 1))) / reference.mean(0)
        p_values.append(mean_tests({"one": ratios}, reference)["one"]["p"][0])
    for level in (0.05, 0.001):
        assert binomtest(int(np.sum(np.array(p_values) < level)), 2000, level, "greater").pvalue > 1e-4


@pytest.mark.parametrize("spp", [1, 16])
def test_one_percent_is_found_and_none_is_not(spp: int) -> None:
    """The mean of 64·3072 pixels of variance 1/2 is known to 0.0016; with 16 samples to 0.0004."""
    contestants = {
        "right": sampler(0.5, 0.1),
        "bright": sampler(0.5, 0.1, gain=1.01),
        "dark": sampler(0.5, 0.1, gain=0.99),
        "also right": sampler(0.1, 0.1, told=1.0),
    }
    effort = Effort(math.inf, 64, 2, spp=[spp])
    rows = figures(take_turns(contestants, EXACT, effort), EXACT)
    assert {name: row["biased"] for name, row in rows.items()} == {
        "right": False,
        "bright": True,
        "dark": True,
        "also right": False,
    }
    assert all(row["spp"] == [spp] for row in rows.values())
    error = math.sqrt(0.5 / spp / TRUTH[..., 0].size / 64)
    for z, mean in zip(rows["bright"]["z"], TRUTH.mean((0, 1))):
        assert z == pytest.approx(0.01 * mean / error, rel=0.4), "its own expected error, found from 64 pictures"
    for z, p in zip(rows["right"]["z"], rows["right"]["p"]):
        assert p == pytest.approx(1 - (1 - 2 * t.sf(abs(z), 63)) ** 12, rel=0.3)


def test_the_references_error_is_no_bias() -> None:
    """Steps differ by a tenth, so the reference's mean is known to 6 %; no contestant must be called biased for it."""
    steps = [gain * TRUTH for gain in (1.0, 1.1, 1.2)]
    reference = Reference(np.zeros((0, 3)), np.zeros_like(TRUTH), np.zeros_like(TRUTH))
    for step in steps:
        reference = reference.plus(step)
    row = figures(take_turns({"right": sampler(1e-4, 0.1)}, reference, Effort(0.1, 16, 2)), reference)["right"]
    assert row["mean_ratio"] == pytest.approx([1 / 1.1] * 3, abs=1e-3) and not row["biased"]
    assert row["z"] == pytest.approx([-0.1 / (0.1 / math.sqrt(3))] * 3, rel=0.01)


def test_what_is_exact_is_unbiased_and_black_channels_say_nothing() -> None:
    """Float32 rounding is no bias; 1e-4 without noise is one. A single seed gives no error estimate."""
    steps = np.ones((8, 3)) * (1.0, 0.5, 0.0)
    exact = np.tile([1 + 6e-8, 1 - 1e-7, math.nan], (16, 1))
    rows = mean_tests({"exact": exact, "off": exact + 1e-4, "one": exact[:1]}, steps)
    assert [row["biased"] for row in rows.values()] == [False, True, False]
    assert [math.isnan(p) for p in rows["exact"]["p"]] == [False, False, True]
    assert all(math.isnan(p) for p in rows["one"]["p"])
