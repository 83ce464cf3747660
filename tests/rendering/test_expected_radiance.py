"""Expected radiance per pixel, against a loop over the pixels."""

from __future__ import annotations

import numpy as np
import pytest

from clrt.rendering.film.expected_radiance import REACH, SINGLE_MOST, Doubles, expected

pytestmark = pytest.mark.statistics

INNER = (slice(REACH, -REACH),) * 2
#: Relative precision of single-precision sums over a window.
PRECISION = 1e-5


def picture(seed: int) -> tuple[Doubles, Doubles]:
    """Return two flat noisy halves and their variance; some pixels are outliers, with the variance of one."""
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
        window = values[y - reach : y + reach + 1, x - reach : x + reach + 1, c].copy()
        window[reach, reach] = 0
        return float(window.sum() / (window.size - 1))

    def towards(start: float, end: float, variance: float) -> float:
        by_chance = min(variance / (end - start) ** 2, 1.0)
        return by_chance * start + (1 - by_chance) * end

    around = towards(others(mean, 8), others(mean, 2), max(others(variance, 2), others(variance, 8)) / 24)
    return float(towards(around, mean[y, x, c], variance[y, x, c]))


@pytest.mark.parametrize("seed", range(3))
def test_as_one_by_one(seed: int) -> None:
    mean, variance = picture(seed)
    found = expected(mean, variance)
    for y, x, c in np.ndindex(found.shape):
        each = one_by_one(mean, variance, y + REACH, x + REACH, c)
        assert found[y, x, c] == pytest.approx(each, rel=PRECISION)


def test_what_is_known_is_expected() -> None:
    mean = picture(0)[0]
    np.testing.assert_allclose(expected(mean, np.zeros_like(mean)), mean[INNER], rtol=1e-12)


def test_a_pixel_bright_by_chance_is_not() -> None:
    """An outlier is not expected to be bright, nor are its neighbours, though a part of it is spread to them."""
    mean, variance = np.full((36, 36, 3), 0.5), np.full((36, 36, 3), 1e-4)
    mean[18, 18], variance[18, 18] = 1000.0, 1e6
    found = expected(mean, variance)
    assert found[10, 10].max() < 0.6 and found.max() < 20
    np.testing.assert_allclose(found[1, 1], 0.5)


def test_without_any_variance_known_it_is_what_lies_around() -> None:
    mean = picture(1)[0]
    found = expected(mean, np.full_like(mean, np.nan))
    window = mean[: 2 * REACH + 1, : 2 * REACH + 1]
    np.testing.assert_allclose(found[0, 0], (window.sum(axis=(0, 1)) - mean[REACH, REACH]) / 288, rtol=PRECISION)


@pytest.mark.parametrize("samples", [2, 4, 64])
@pytest.mark.parametrize("bright", [1e4, 1e7, 1e9, 1e12, 1e15, 1e3 * SINGLE_MOST])
def test_single_precision_is_enough_around_a_pixel(bright: float, samples: int) -> None:
    """An outlier from one bright sample, and its neighbours: its light is in no sum from which it is subtracted
    again."""
    mean, variance = picture(0)
    drawn = np.full(samples, 5.0)
    drawn[0] = bright
    mean[10, 12], variance[10, 12] = drawn.mean(), drawn.var(ddof=1) / samples
    found = expected(mean, variance)
    for y, x in np.ndindex(found.shape[:2]):
        each, its_own = one_by_one(mean, variance, y + REACH, x + REACH, 0), (y + REACH, x + REACH) == (10, 12)
        assert found[y, x, 0] == pytest.approx(each, rel=PRECISION, abs=4e-16 * bright * its_own)


def test_differences_far_below_the_noise_are_chance() -> None:
    """Between almost equal windows the ratio of variance to squared difference exceeds float32: no warning, which
    would be an error here, and the mean of the windows."""
    mean = np.full((20, 20, 3), 0.35)
    mean[9:12, 9:12] += 1e-7
    near = expected(mean, np.full(mean.shape, 1e30))
    np.testing.assert_allclose(near, 0.35, rtol=1e-5)
