"""How far a progressive picture is from its limit, judged by how much it changed when its samples doubled."""

from __future__ import annotations

from math import exp

import numpy as np
from numpy.typing import NDArray

from .bands import in_bands
from .film import Film
from .tiles import over_pixels, tile_pixels, tile_sums

#: By how much the squared error falls when samples double: as for independent ones, up to the third power, where it was
#: measured.
LEAST_FALL, MOST_FALL = 2.0, 8.0
#: And while only two samples are known.
FIRST_FALL = 2.4
#: Over how many doublings it is measured, and the power of that, over LEAST_FALL, which is expected to last.
STEPS, LASTING = 3, 2 / 3
TINY = float(np.finfo(np.float64).tiny)


class NoiseEstimate:
    """Estimates √relMSE at any number of samples from the pictures at powers of two, tile by tile.

    A pixel's samples are not independent, so their variance says too much. But the two halves of the first 2n samples
    are alike, which is enough: with E_n the mean of the first n and V(n) its squared error, Cov(E_n, E_2n) = V(2n),
    hence the mean square of E_n − E_2n is V(n) − V(2n). If V falls by r with each doubling that is (r − 1)·V(2n). The
    last such difference and that of three doublings before, over all tiles that have both, tell how fast it fell,
    beside the samples' variance at these times, which falls by 2: what is expected of a pixel was not known alike then,
    and divides both. As the fall always slows down, towards 2 in the end, r is 2 times a power of what it fell faster,
    and less as far as the tiles differ in that (James and Stein 1961, as in expected.py). Blocks of 2^k samples, taken
    for independent of each other, give V between powers of two. It is never more than the samples' variance gives
    (Film.noise).

    planned_spp: where the sampler begins anew, r is 2 from there on.
    """

    def __init__(self, planned_spp: int | None = None) -> None:
        self._planned = planned_spp or 1 << 32
        self._mean: NDArray[np.float32] | None = None
        #: V(n/2) − V(n) at n = 2, 4, 8 …, and what n independent samples would leave of variance: sums over a tile's
        #: values (2, rows, columns), NaN where it has fewer samples.
        self._changes: list[NDArray[np.float64]] = []
        #: How many of these each tile has, −1 before its first sample.
        self._level: NDArray[np.int64] = np.zeros((0, 0), np.int64)

    def arrays(self) -> tuple[NDArray[np.float32], NDArray[np.float64], NDArray[np.int64]]:
        """All that it knows: the picture's mean (height, width, 3), the changes (k, 2, rows, columns), and how many of
        these each tile has; empty arrays before the first picture."""
        mean = np.zeros((0, 0, 3), np.float32) if self._mean is None else self._mean
        return mean, np.array(self._changes).reshape(len(self._changes), 2, *self._level.shape), self._level

    def restore(self, mean: NDArray[np.float32], changes: NDArray[np.float64], level: NDArray[np.int64]) -> None:
        """Goes on from what `arrays` gave."""
        self._mean, self._changes, self._level = mean if mean.size else None, list(changes), level

    def add(self, film: Film, tile_samples: NDArray[np.int64]) -> None:
        """The film, with samples (rows, columns) of each tile; counts only where those are the next power of two."""
        mean = film.mean
        if self._mean is None:
            self._mean, self._level = np.zeros_like(mean, np.float32), np.full(tile_samples.shape, -1)
        due = tile_samples == 2 ** (self._level + 1)
        if not due.any():
            return
        before, level = self._mean, self._level[due]
        if level.max() >= 0:    # the first sample is no change
            relative = film.relative_to
            change = np.concatenate(in_bands(
                mean.shape, lambda rows: tile_sums(((mean[rows] - before[rows]) / relative[rows]) ** 2), film.unwanted))
            both = np.stack([change, film.tile_limits])
        self._changes += [np.full((2, *due.shape), np.nan) for _ in range(max(level) + 1 - len(self._changes))]
        for k in sorted({*level.tolist()} - {-1}):
            at_k = due & (self._level == k)
            self._changes[k][:, at_k] = both[:, at_k]
        self._level[due] += 1
        np.copyto(self._mean, mean, where=over_pixels(due, mean.shape[1::-1])[..., None])

    def at(self, film: Film, tile_samples: NDArray[np.int64]) -> float | None:
        """Estimated √relMSE of the film with so many samples in each tile; None before there are two."""
        limit = film.noise
        if limit is None or not self._changes or self._level.min() < 1:
            return limit
        return min(limit, float(np.sqrt(np.sum(self.tile_errors(tile_samples)) / film.mean.size)))

    def of_tiles(self, tile_samples: NDArray[np.int64], size: tuple[int, int], percent: float | None) -> float | None:
        """The √relMSE of a tile that so many per cent of the tiles of a picture of `size` do not exceed; None before
        all have two samples, and of no percentage."""
        if percent is None or not self._changes or self._level.min() < 1:
            return None
        errors = self.tile_errors(tile_samples) / (3 * tile_pixels(size))
        return float(np.sqrt(np.percentile(errors, percent, method="higher")))

    def tile_errors(self, tile_samples: NDArray[np.int64]) -> NDArray[np.float64]:
        """(rows, columns) estimated sums over a tile's values of squared error / (expected² + 0.01).

        All tiles must have had two samples.
        """
        errors = np.zeros(tile_samples.shape)
        for spp, level in {*zip(tile_samples.ravel().tolist(), self._level.ravel().tolist())}:
            alike = (tile_samples == spp) & (self._level == level)
            fall = self._fall(level)
            at_power = self._changes[level - 1][0, alike] / (fall - 1)
            blocks = [bit for bit in range(spp.bit_length()) if spp >> bit & 1]
            errors[alike] = at_power * sum(4.0**bit * fall ** (level - bit) for bit in blocks) / spp**2
        return errors

    def _fall(self, level: int) -> float:
        """V(n/2)/V(n) at n = 2^level, over all tiles that came so far."""
        steps = min(level - 1, STEPS)
        now, earlier = self._changes[level - 1], self._changes[level - 1 - steps]
        known = np.isfinite(now + earlier).all(axis=0)   # not where a sample was dropped before there were others
        (changes, variance), (changes_then, variance_then) = now[:, known], earlier[:, known]
        if np.sum(changes) <= 0 or 1 << level > self._planned:
            return LEAST_FALL
        if level < 2:
            return FIRST_FALL
        fallen = np.sum(changes_then) / np.sum(changes) * (np.sum(variance) / max(np.sum(variance_then), TINY))
        faster = float(np.log(np.clip(fallen ** (1 / steps), 1, MOST_FALL / LEAST_FALL)))
        by_chance = _squared_error_of_log_ratio(changes_then, changes) / steps**2
        lasting = LASTING * (1 - by_chance / faster**2) if faster**2 > by_chance else 0.0
        return LEAST_FALL * exp(lasting * faster)


def _squared_error_of_log_ratio(above: NDArray[np.float64], below: NDArray[np.float64]) -> float:
    """The squared standard error of log(Σ above / Σ below), of tiles taken for independent of each other (by the delta
    method; the samples' variances are taken for exact); without bound where there is one tile."""
    parts = above / max(np.sum(above), TINY) - below / np.sum(below)
    return float(np.sum(parts**2) * parts.size / (parts.size - 1)) if parts.size > 1 else np.inf
