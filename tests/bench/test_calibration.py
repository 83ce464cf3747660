"""The calibration of error estimates is correct for contestants that report a known fraction of their error."""

from __future__ import annotations

from math import isnan, nan

import numpy as np
import pytest

from clrt.bench.convergence.calibration import calibration, calibrations, noise_ratio
from clrt.bench.convergence.converge import Effort, figures, take_turns
from clrt.bench.convergence.reference import Reference

from .known import EXACT, TRUTH, UNIT, sampler


@pytest.mark.parametrize(
    ("noise", "error", "own", "ratio"),
    [
        (0.2, 0.04, 0.0, 1.0),
        (0.3, 0.04, 0.0, 1.5),
        (0.2, 0.05, 0.01, 1.0),
        (0.1, 0.02, 0.01, nan),
        (0.1, 0.0, 0.0, nan),
        (nan, 0.04, 0.0, nan),
    ],
)
def test_the_references_error_is_none_of_the_pictures(noise: float, error: float, own: float, ratio: float) -> None:
    """The reference's own error is subtracted; an error that does not exceed it gives no ratio."""
    assert noise_ratio(noise, error, own) == pytest.approx(ratio, nan_ok=True)


def test_what_is_told_is_compared_with_what_is_true() -> None:
    """For normal errors of 9216 values, the true √relMSE is within a few percent of the expected one."""
    contestants = {
        "right": sampler(0.5, 0.1, told=1.0),
        "high": sampler(0.5, 0.1, told=1.4),
        "low": sampler(0.5, 0.1, told=0.7),
        "mute": sampler(0.5, 0.1),
    }
    rng = np.random.default_rng(1)
    noisy = Reference(np.zeros((0, 3)), np.zeros_like(TRUTH), np.zeros_like(TRUTH))
    for _ in range(64):
        noisy = noisy.plus(TRUTH + rng.normal(size=TRUTH.shape))
    for reference in (EXACT, noisy):
        rows = figures(take_turns(contestants, reference, Effort(1.0, 4, 2)), reference)
        ratios = rows["right"]["noise_ratio"]
        assert [len(level) for level in ratios] == [4] * 4 and all(isnan(ratio) for ratio in ratios[0]), "1 sample"
        found = calibrations([{"contestants": rows}] * 2)
        assert list(found) == ["right", "high", "low"], "of pictures that tell nothing there is nothing to say"
        assert [row["pictures"] for row in found.values()] == [2 * 3 * 4] * 3
        assert [row["within"] for row in found.values()] == [1, 0, 0]
        assert [row["median"] for row in found.values()] == pytest.approx([1, 1.4, 0.7], rel=0.03)
    assert noisy.relmse == pytest.approx(UNIT / 64, rel=0.1), "a quarter of the least error that was compared with it"


def test_the_worst_is_the_farthest_factor() -> None:
    row = calibration([1.0, 1.1, 1.19, 0.84, 1.21, 0.5, 1.9, 0.83])
    assert row == {"pictures": 8, "within": 0.5, "median": pytest.approx(1.05), "worst": 0.5}
    assert calibration([0.0, 9.0])["worst"] == 0
