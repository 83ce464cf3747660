"""What is expected of a pixel, beside the same pixel by pixel."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.rendering.expected import BRIGHTEST, REACH, expected

Doubles = NDArray[np.float64]

INNER = (slice(REACH, -REACH),) * 2


def picture(seed: int) -> tuple[Doubles, Doubles]:
    """Two flat halves with noise, and its variance; some pixels are bright by chance, and say so."""
    rng = np.random.default_rng(seed)
    mean = np.where(np.arange(30)[:, None, None] < 14, 0.2, 3.0) + np.zeros((30, 26, 3))
    variance = np.asarray(0.01 * rng.random(mean.shape))
    mean = mean + np.sqrt(variance) * rng.normal(size=mean.shape)
    bright = rng.random(mean.shape[:2]) < 0.03
    mean[bright] += 40.0
    variance[bright] += 1600.0
    return mean, variance


def one_by_one(mean: Doubles, variance: Doubles, y: int, x: int, c: int) -> float:
    def others(values: Doubles, reach: int) -> float:
        window = values[y - reach:y + reach + 1, x - reach:x + reach + 1, c]
        return float((window.sum() - values[y, x, c]) / (window.size - 1))

    def part(variance: float, difference: float) -> float:
        return max(1 - variance / difference**2, 0.0)

    far, near = others(mean, 8), others(mean, 2)
    around = far + part(max(others(variance, 2), others(variance, 8)) / 24, near - far) * (near - far)
    return float(around + part(variance[y, x, c], mean[y, x, c] - around) * (mean[y, x, c] - around))


@pytest.mark.parametrize("seed", range(3))
def test_as_one_by_one(seed: int) -> None:
    mean, variance = picture(seed)
    found = expected(mean, variance)
    for y, x, c in np.ndindex(found.shape):
        each = one_by_one(mean, variance, y + REACH, x + REACH, c)
        assert found[y, x, c] == pytest.approx(each, rel=1e-9, abs=1e-9)


def test_what_is_known_is_expected() -> None:
    mean = picture(0)[0]
    np.testing.assert_allclose(expected(mean, np.zeros_like(mean)), mean[INNER], rtol=1e-12)


def test_a_pixel_bright_by_chance_is_not() -> None:
    """Nor are those beside it, though a part of it is theirs, too."""
    mean, variance = np.full((36, 36, 3), 0.5), np.full((36, 36, 3), 1e-4)
    mean[18, 18], variance[18, 18] = 1000.0, 1e6
    found = expected(mean, variance)
    assert found[10, 10].max() < 0.6 and found.max() < 20
    np.testing.assert_allclose(found[1, 1], 0.5)


def test_without_any_variance_known_it_is_what_lies_around() -> None:
    mean = picture(1)[0]
    found = expected(mean, np.full_like(mean, np.nan))
    window = mean[:2 * REACH + 1, :2 * REACH + 1]
    np.testing.assert_allclose(found[0, 0], (window.sum(axis=(0, 1)) - mean[REACH, REACH]) / 288, rtol=1e-12)


@pytest.mark.parametrize("bright", [1e6, 1e12, BRIGHTEST])
def test_single_precision_is_enough(bright: float) -> None:
    """Also beside a pixel that is brighter by far: its light is in no sum that it is taken out of again."""
    mean, variance = picture(0)
    mean[14, 12], variance[14, 12] = bright, bright**2
    found = expected(mean.astype(np.float32), variance.astype(np.float32))
    assert found.dtype == np.float32
    np.testing.assert_allclose(found, expected(mean, variance), rtol=2e-5)
