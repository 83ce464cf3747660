"""The accumulated picture on the host: mean, noise estimate and counts from the device's sums (kernels/film.cl)."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .bands import in_bands

#: Added to the squared reference in relMSE, so that black pixels do not divide by zero.
RELATIVE_FLOOR = 0.01


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
        mean = np.empty((*self.pixels.shape, 3))

        def fill(rows: slice) -> None:
            pixels = self.pixels[rows]
            total = pixels[name].astype(np.float64) + pixels[f"{name}_error"]
            mean[rows] = total / np.maximum(pixels["count"], 1)[..., None]

        in_bands(len(mean), fill)
        return mean

    @property
    def variance(self) -> NDArray[np.float64]:
        """(height, width, 3): of the mean, the sample variance over n; NaN of fewer than two samples."""
        return np.concatenate(in_bands(len(self.mean), self._variance))

    def _variance(self, rows: slice) -> NDArray[np.float64]:
        """Where squares were too large to be summed (kernels/film.cl) it is taken as mean², the most it can be."""
        pixels, most = self.pixels[rows], self.mean[rows] ** 2
        count = pixels["count"].astype(np.float64)[..., None]
        with np.errstate(divide="ignore", invalid="ignore"):
            squares = (pixels["square"].astype(np.float64) + pixels["square_error"]) / count
            summed = squares >= (1 - 1e-6) * most    # false for NaN, too
            variance = np.where(summed, np.maximum(squares - most, 0) / (count - 1), most)
        return np.where(count < 2, np.nan, variance)

    def relative_to(self, rows: slice) -> NDArray[np.float64]:
        """(rows, width, 3): what squared errors are divided by in relMSE, expected² + 0.01, as far as it is known.

        What is expected of a pixel is the mean of the eight around it, so that one bright by chance does not count
        itself; and from there on towards its own as far as its variance cannot explain the difference (James and Stein
        1961).
        """
        own, variance = self.mean[rows], self._variance(rows)
        first, edges = max(rows.start - 1, 0), (int(rows.start == 0), int(rows.stop == len(self.mean)))
        padded = np.pad(self.mean[first:rows.stop + 1], (edges, (1, 1), (0, 0)), mode="edge")
        sums = padded[:-2] + padded[1:-1] + padded[2:]
        around = (sums[:, :-2] + sums[:, 1:-1] + sums[:, 2:] - own) / 8
        difference = own - around
        with np.errstate(divide="ignore", invalid="ignore"):
            towards_own = np.nan_to_num(np.maximum(1 - variance / difference**2, 0))
        return np.asarray((around + towards_own * difference) ** 2 + RELATIVE_FLOOR)

    @cached_property
    def noise(self) -> float | None:
        """√relMSE that independent samples would have: sqrt(mean(Var[mean] / (expected² + 0.01))) over all values.

        None before every pixel has two samples.
        """
        count = self.pixels["count"]
        if not count.size or count.min() < 2:
            return None
        sums = in_bands(len(self.mean), lambda rows: float(np.sum(self._variance(rows) / self.relative_to(rows))))
        return float(np.sqrt(sum(sums) / self.mean.size))

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
