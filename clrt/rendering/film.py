"""The accumulated picture on the host: mean, noise estimate and counts from the device's sums (kernels/film.cl)."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Added to the squared reference in relMSE, so that black pixels do not divide by zero.
RELATIVE_FLOOR = 0.01


def relative_to(mean: NDArray[np.float64], variance: NDArray[np.float64]) -> NDArray[np.float64]:
    """expected² + 0.01 for a picture (h, w, 3) with the variance of its values.

    What is expected of a pixel is the mean of the eight around it, so that one bright by chance does not count itself;
    and from there on towards its own as far as its variance cannot explain the difference (James and Stein 1961).
    """
    padded = np.pad(mean, ((1, 1), (1, 1), (0, 0)), mode="edge")
    rows = padded[:-2] + padded[1:-1] + padded[2:]
    around = (rows[:, :-2] + rows[:, 1:-1] + rows[:, 2:] - mean) / 8
    difference = mean - around
    with np.errstate(divide="ignore", invalid="ignore"):
        own = np.nan_to_num(np.maximum(1 - variance / difference**2, 0))
    return np.asarray((around + own * difference) ** 2 + RELATIVE_FLOOR)


class Film:
    """A copy of the device's film. pixels: (height, width) PIXEL records, or PIXEL_WITH_DIRECT."""

    def __init__(self, pixels: NDArray[Any]) -> None:
        self.pixels = pixels

    @cached_property
    def mean(self) -> NDArray[np.float64]:
        """(height, width, 3): mean of the samples kept; 0 where there are none."""
        return self._mean_of("sum")

    @property
    def direct(self) -> NDArray[np.float64]:
        """(height, width, 3): what of the mean came with two path edges at most; only of a film that keeps it apart."""
        return self._mean_of("direct")

    def _mean_of(self, name: str) -> NDArray[np.float64]:
        total = self.pixels[name].astype(np.float64) + self.pixels[f"{name}_error"]
        return np.asarray(total / np.maximum(self.pixels["count"], 1)[..., None])

    @cached_property
    def variance(self) -> NDArray[np.float64]:
        """(height, width, 3): of the mean, the sample variance over n; NaN of fewer than two samples.

        Where squares were too large to be summed (kernels/film.cl) it is taken as mean², the most it can be.
        """
        count = self.pixels["count"].astype(np.float64)[..., None]
        with np.errstate(divide="ignore", invalid="ignore"):
            squares = (self.pixels["square"].astype(np.float64) + self.pixels["square_error"]) / count
            summed = squares >= (1 - 1e-6) * self.mean**2    # false for NaN, too
            variance = np.where(summed, np.maximum(squares - self.mean**2, 0) / (count - 1), self.mean**2)
        return np.where(count < 2, np.nan, variance)

    @cached_property
    def relative_to(self) -> NDArray[np.float64]:
        """(height, width, 3): what squared errors are divided by in relMSE, as far as this picture tells."""
        return relative_to(self.mean, self.variance)

    @property
    def noise(self) -> float | None:
        """√relMSE that independent samples would have: sqrt(mean(Var[mean] / (expected² + 0.01))) over all values.

        None before every pixel has two samples.
        """
        count = self.pixels["count"]
        if not count.size or count.min() < 2:
            return None
        return float(np.sqrt(np.mean(self.variance / self.relative_to)))

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
