"""The accumulated picture on the host: mean, noise estimate and counts from the device's sums (kernels/film.cl)."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .bands import in_bands

#: Added to the squared reference in relMSE, so that black pixels do not divide by zero.
RELATIVE_FLOOR = 0.01


class Film:
    """A copy of the device's film. pixels: (height, width) PIXEL records, or PIXEL_WITH_DIRECT; unwanted: asked
    while its error is estimated, which ends with `Unwanted` where that is so."""

    def __init__(self, pixels: NDArray[Any], unwanted: Callable[[], bool] = lambda: False) -> None:
        self.pixels, self.unwanted = pixels, unwanted

    @cached_property
    def mean(self) -> NDArray[np.float64]:
        """(height, width, 3): mean of the samples kept; 0 where there are none."""
        return self._mean_of("sum")

    @property
    def direct(self) -> NDArray[np.float64]:
        """(height, width, 3): what of the mean came with two path edges at most; only of a film that keeps it apart."""
        return self._mean_of("direct")

    def _mean_of(self, name: str) -> NDArray[np.float64]:
        mean = np.empty((*self.pixels.shape, 3))

        def fill(rows: slice) -> None:
            pixels = self.pixels[rows]
            total = pixels[name].astype(np.float64) + pixels[f"{name}_error"]
            mean[rows] = total / np.maximum(pixels["count"], 1)[..., None]

        in_bands(mean.shape, fill)
        return mean

    @property
    def variance(self) -> NDArray[np.float64]:
        """(height, width, 3): of the mean, the sample variance over n; NaN of fewer than two samples."""
        return np.concatenate(in_bands(self.mean.shape, self._variance))

    def _variance(self, rows: slice) -> NDArray[np.float64]:
        """Where squares were too large to be summed (kernels/film.cl) it is taken as mean², the most it can be."""
        pixels, most = self.pixels[rows], self.mean[rows] ** 2
        count = pixels["count"].astype(np.float64)[..., None]
        with np.errstate(divide="ignore", invalid="ignore"):
            squares = (pixels["square"].astype(np.float64) + pixels["square_error"]) / count
            summed = squares >= (1 - 1e-6) * most    # false for NaN, too
            variance = np.where(summed, np.maximum(squares - most, 0) / (count - 1), most)
        return np.where(count < 2, np.nan, variance)

    @property
    def relative_to(self) -> NDArray[np.float32]:
        """(height, width, 3): what errors are divided by in relMSE, √(expected² + 0.01), as far as it is known.

        What is expected of a pixel is the mean of the eight around it, so that one bright by chance does not count
        itself; and from there on towards its own as far as its variance cannot explain the difference (James and Stein
        1961).
        """
        return self._judged[0]

    @cached_property
    def noise(self) -> float | None:
        """√relMSE that independent samples would have: sqrt(mean(Var[mean] / (expected² + 0.01))) over all values.

        None before every pixel has two samples.
        """
        count = self.pixels["count"]
        if not count.size or count.min() < 2:
            return None
        return float(np.sqrt(self._judged[1] / self.mean.size))

    @cached_property
    def _judged(self) -> tuple[NDArray[np.float32], float]:
        """`relative_to`, and the sum of the variances over that: the same is needed for both."""
        relative = np.empty(self.mean.shape, np.float32)

        def judge(rows: slice) -> float:
            own, variance = self.mean[rows], self._variance(rows)
            first, edges = max(rows.start - 1, 0), (int(rows.start == 0), int(rows.stop == len(self.mean)))
            padded = np.pad(self.mean[first:rows.stop + 1], (edges, (1, 1), (0, 0)), mode="edge")
            sums = padded[:-2] + padded[1:-1] + padded[2:]
            around = (sums[:, :-2] + sums[:, 1:-1] + sums[:, 2:] - own) / 8
            difference = own - around
            with np.errstate(divide="ignore", invalid="ignore"):
                towards_own = np.fmax(1 - variance / difference**2, 0)   # 0 for NaN, too
            squared = (around + towards_own * difference) ** 2 + RELATIVE_FLOOR
            relative[rows] = np.sqrt(squared)
            return float(np.sum(variance / squared))

        return relative, sum(in_bands(self.mean.shape, judge, self.unwanted))

    @property
    def samples(self) -> int:
        """Samples in the film, dropped ones included."""
        return int(self.pixels["count"].sum(dtype=np.int64)) + self.nonfinite_samples

    @property
    def nonfinite_samples(self) -> int:
        """How many samples were dropped because they were NaN or infinite."""
        return int(self.pixels["dropped"].sum(dtype=np.int64))

    @property
    def rays(self) -> int:
        """Rays traced; each counter wraps at 2³², long after its picture has converged. A tile's may all be
        counted with its first pixel (kernels/wave.cl)."""
        return int(self.pixels["rays"].sum(dtype=np.int64))
