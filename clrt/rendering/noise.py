"""How far a progressive picture is from its limit, judged by how much it changed when its samples doubled."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .film import Film, relative_to

#: By how much the squared error falls when samples double: as for independent ones, up to the third power.
LEAST_FALL, MOST_FALL = 2.0, 8.0


class NoiseEstimate:
    """Estimates √relMSE at any number of samples from the pictures at powers of two.

    A pixel's samples are not independent, so their variance says too much. But the two halves of the first 2n samples
    are alike, which is enough: with E_n the mean of the first n and V(n) its squared error, Cov(E_n, E_2n) = V(2n),
    hence the mean square of E_n − E_2n is V(n) − V(2n). If V falls by r with each doubling that is (r − 1)·V(2n). The
    ratios of the last such differences tell how fast it fell, the slower of one step and two counts, and as that always
    slows down, towards 2 in the end, r is the geometric mean of both. Blocks of 2^k samples, taken for independent of
    each other, give V between powers of two. It is never more than the samples' variance gives (Film.noise).

    planned_spp: where the sampler begins anew, r is 2 from there on.
    """

    def __init__(self, planned_spp: int | None = None) -> None:
        self._planned = planned_spp or 1 << 32
        self._mean: NDArray[np.float32] | None = None
        self._changes: list[float] = []     # V(n/2) − V(n) at n = 2, 4, 8 …

    def add(self, film: Film, spp: int) -> None:
        """The film at `spp` samples a pixel; counts only if that is the next power of two."""
        if spp != 1 << (len(self._changes) + (self._mean is not None)):
            return
        mean = film.mean
        if self._mean is not None:
            self._changes.append(float(np.mean((mean - self._mean) ** 2 / relative_to(mean))))
        self._mean = mean.astype(np.float32)

    def at(self, film: Film, spp: int) -> float | None:
        """Estimated √relMSE of the film at `spp` samples a pixel; None before there are two."""
        limit = film.noise
        if limit is None or not self._changes:
            return limit
        fall = self._fall()
        last = len(self._changes)           # log2 of the samples of the last change
        at_power = self._changes[-1] / (fall - 1)
        blocks = [bit for bit in range(spp.bit_length()) if spp >> bit & 1]
        square = sum(4.0**bit * at_power * fall ** (last - bit) for bit in blocks) / spp**2
        return min(limit, float(np.sqrt(square)))

    def _fall(self) -> float:
        """V(n/2)/V(n) at the last power of two."""
        changes = self._changes
        if len(changes) < 2 or changes[-1] <= 0 or 1 << len(changes) > self._planned:
            return LEAST_FALL
        slowest = min((changes[-1 - steps] / changes[-1]) ** (1 / steps) for steps in range(1, len(changes[-3:])))
        return float(np.sqrt(LEAST_FALL * np.clip(slowest, LEAST_FALL, MOST_FALL)))
