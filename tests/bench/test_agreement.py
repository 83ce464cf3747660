"""Images with equal means are distinguished from others, tested with errors of known distribution."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.bench.convergence.contestants import Picture
from clrt.bench.renderers.agreement import Means, agreement, block_means, compared, means_of
from clrt.bench.significance import FAMILY, sidak
from clrt.errors import UsageError
from clrt.scene.model import RenderSettings, Scene

SCENE = np.random.default_rng(3).uniform(0.05, 2, (64, 96, 3))
SEEDS = range(16)


def renderer(
    first: int, change: Callable[[NDArray[np.float64]], NDArray[np.float64]] = lambda mean: mean, spread: float = 0.3
) -> Callable[[int, int], Picture]:
    """Return a renderer of SCENE with exponential errors, correlated along rows of pixels as samplers' errors are."""

    def draw(spp: int, seed: int) -> Picture:
        errors = np.random.default_rng([first, seed]).exponential(size=(64, 12, 3)).repeat(8, axis=1) - 1
        return Picture(spp, 0.0, 0.0, (change(SCENE) * (1 + spread * errors / np.sqrt(spp))).astype(np.float32))

    return draw


def means(*arguments: object, **options: object) -> Means:
    return means_of(renderer(*arguments, **options), 64, SEEDS)  # type: ignore[arg-type]


def test_blocks_are_means_of_their_pixels() -> None:
    pixels = np.arange(5 * 7 * 3, dtype=np.float64).reshape(5, 7, 3)
    blocks = block_means(pixels, 2)
    assert blocks.shape == (2, 3, 3)
    np.testing.assert_allclose(blocks[1, 2], pixels[2:4, 4:6].mean((0, 1)))


def test_pictures_of_one_mean_agree_as_often_as_they_should() -> None:
    """In 200 comparisons the smallest corrected p is below 0.1 about 20 times; 36 is beyond 4 standard deviations."""
    p = [compared(means(2 * i), means(2 * i + 1))["p"] for i in range(200)]
    assert np.count_nonzero(np.array(p) < 0.1) < 36
    assert min(p) > sidak(FAMILY, len(p))
    told = compared(means(1), means(2, spread=0.6))
    assert told["agree"] and told["rejected"] == 0 and told["blocks"] == 24
    assert told["mean_ratio"] == pytest.approx([1, 1, 1], abs=5 * max(told["mean_error"]))


def brighter_block(mean: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.where((np.arange(64)[:, None, None] // 16 == 2) & (np.arange(96)[:, None] // 16 == 1), 1.03, 1) * mean


@pytest.mark.parametrize(
    ("change", "rejected"),
    [(brighter_block, 3), (lambda mean: mean * (1.02, 1, 1), 24)],
    ids=["one block by 3 %", "red by 2 %"],
)
def test_what_differs_is_found(change: Callable[[NDArray[np.float64]], NDArray[np.float64]], rejected: int) -> None:
    told = compared(means(1, change), means(2))
    assert not told["agree"] and told["rejected"] == rejected and told["p"] < 1e-6
    assert told["difference"] == pytest.approx(0.03 if rejected == 3 else 0.02, abs=0.006)


def test_small_differences_of_the_mean_are_no_matter_of_blocks() -> None:
    """A difference of 1 %, with block errors of 10 %, is found only by the mean of the image."""
    noisy = compared(means(1, lambda mean: mean * 1.01, spread=3), means(2, spread=3))
    assert noisy["rejected"] == 0 and noisy["mean_ratio"] == pytest.approx([1.01] * 3, abs=5 * max(noisy["mean_error"]))


def test_black_agrees_with_black_only() -> None:
    def black(mean: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.where(np.arange(96)[:, None] < 48, 0, mean)

    assert compared(means(1, black), means(2, black))["agree"]
    assert not compared(means(1, black), means(2))["agree"]
    assert compared(means(1, lambda mean: 0 * mean), means(2, lambda mean: 0 * mean))["mean_ratio"] == [1, 1, 1]


def test_pictures_smaller_than_a_block_are_refused() -> None:
    with pytest.raises(UsageError, match="64x8 pixels have no block of 16x16"):
        agreement(Scene(render=RenderSettings(size=(64, 8))), 1, 2, None)
