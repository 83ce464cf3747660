"""The accumulated picture on the host: mean, noise estimate and counts from the device's sums (kernels/film.cl)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Added to the squared reference in relMSE, so that black pixels do not divide by zero.
RELATIVE_FLOOR = 0.01


def relative_to(mean: NDArray[np.floating[Any]]) -> NDArray[np.floating[Any]]:
    """expected² + 0.01 for a picture (h, w, 3); a noisy pixel's neighbours tell what is to be expected of it."""
    padded = np.pad(mean, ((1, 1), (1, 1), (0, 0)), mode="edge")
    rows = padded[:-2] + padded[1:-1] + padded[2:]
    expected = (rows[:, :-2] + rows[:, 1:-1] + rows[:, 2:]) / 9
    return np.asarray(expected**2 + RELATIVE_FLOOR)


class Film:
    """A copy of the device's film. pixels: (height, width) PIXEL records."""

    def __init__(self, pixels: NDArray[Any]) -> None:
        self.pixels = pixels

    @property
    def mean(self) -> NDArray[np.float64]:
        """(height, width, 3): mean of the samples kept; 0 where there are none."""
        total = self.pixels["sum"].astype(np.float64) + self.pixels["sum_error"]
        return np.asarray(total / np.maximum(self.pixels["count"], 1)[..., None])

    @property
    def noise(self) -> float | None:
        """√relMSE that independent samples would have: sqrt(mean(Var[mean] / (expected² + 0.01))) over all values.

        Var[mean] is the sample variance over n. Where squares were too large to be summed (kernels/film.cl) it is taken
        as mean², the most it can be. None before every pixel has two samples.
        """
        count = self.pixels["count"].astype(np.float64)[..., None]
        if not count.size or count.min() < 2:
            return None
        mean = self.mean
        squares = (self.pixels["square"].astype(np.float64) + self.pixels["square_error"]) / count
        summed = squares >= (1 - 1e-6) * mean**2    # false for NaN, too
        variance = np.where(summed, np.maximum(squares - mean**2, 0) / (count - 1), mean**2)
        return float(np.sqrt(np.mean(variance / relative_to(mean))))

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
        """Rays traced; each pixel's counter wraps at 2³², long after its picture has converged."""
        return int(self.pixels["rays"].sum(dtype=np.int64))
