"""Error estimate of a progressive image, from how much it changes whenever its sample count doubles."""

from __future__ import annotations

from math import exp, log

import numpy as np
from numpy.typing import NDArray

from ..cancellation import NEVER, CancellationToken
from ..film.film import Film
from ..film.row_bands import in_bands
from ..film.tiles import over_pixels, tile_pixels, tile_sums

#: Factor by which the squared error falls when samples double: 2 for independent samples, at most the third power of
#: that where it was measured.
LEAST_FALL, MOST_FALL = 2.0, 8.0
#: The same while only two samples are known.
FIRST_FALL = 2.4
#: Number of doublings over which it is measured, and the power of its excess over LEAST_FALL that is expected to last.
STEPS, LASTING = 3, 2 / 3
TINY = float(np.finfo(np.float64).tiny)


class NoiseEstimate:
    """Estimates √relMSE at any sample count from the images at powers of two, tile by tile.

    A pixel's samples are not independent, so their variance overestimates the error. But the two halves of the first 2n
    samples are statistically alike, which is enough: with E_n the mean of the first n and V(n) its squared error,
    Cov(E_n, E_2n) = V(2n), hence the mean square of E_n − E_2n is V(n) − V(2n). If V falls by r with each doubling,
    that is (r − 1)·V(2n). r is measured from the last such difference and the one three doublings before, over all
    tiles that have both, relative to the samples' variance at these times, which falls by 2: the expected pixel values,
    which divide both, were not known equally well then. As convergence always slows down, towards r = 2, r is 2 times a
    power of the measured excess, reduced as far as the tiles disagree (James and Stein 1961, as in
    expected_radiance.py). Blocks of 2^k samples, assumed to be independent, give V between powers of two. The estimate
    never exceeds that from the samples' variance (Film.noise).

    planned_spp: where the sampler starts afresh; r is 2 from there on.
    """

    def __init__(self, planned_spp: int | None = None) -> None:
        self._planned = planned_spp or 1 << 32
        self._mean: NDArray[np.float32] | None = None
        #: V(n/2) − V(n) at n = 2, 4, 8 …, and the variance that n independent samples would have: sums over a tile's
        #: values (2, rows, columns), NaN where it has fewer samples.
        self._changes: list[NDArray[np.float64]] = []
        #: Number of these that each tile has, −1 before its first sample.
        self._level: NDArray[np.int64] = np.zeros((0, 0), np.int64)

    def arrays(self) -> tuple[NDArray[np.float32], NDArray[np.float64], NDArray[np.int64]]:
        """Return the whole state: the image's mean (height, width, 3), the changes (k, 2, rows, columns), and how many
        of these each tile has; empty arrays before the first image."""
        mean = np.zeros((0, 0, 3), np.float32) if self._mean is None else self._mean
        return mean, np.array(self._changes).reshape(len(self._changes), 2, *self._level.shape), self._level

    def restore(self, mean: NDArray[np.float32], changes: NDArray[np.float64], level: NDArray[np.int64]) -> None:
        """Resume from the result of `arrays`."""
        self._mean, self._changes, self._level = mean if mean.size else None, list(changes), level

    def add(self, film: Film, tile_samples: NDArray[np.int64], token: CancellationToken = NEVER) -> None:
        """Add the film, with samples (rows, columns) of each tile; only tiles at the next power of two are used. Raises
        Cancelled by the token."""
        mean = film.mean
        if self._mean is None:
            self._mean, self._level = np.zeros_like(mean, np.float32), np.full(tile_samples.shape, -1)
        due = tile_samples == 2 ** (self._level + 1)
        if not due.any():
            return
        before, level = self._mean, self._level[due]
        if level.max() >= 0:  # the first sample is not a change
            relative, limits = film.relative_variance(token)
            change = np.concatenate(
                in_bands(mean.shape, lambda rows: tile_sums(((mean[rows] - before[rows]) / relative[rows]) ** 2), token)
            )
            both = np.stack([change, limits])
        self._changes += [np.full((2, *due.shape), np.nan) for _ in range(max(level) + 1 - len(self._changes))]
        for k in sorted({*level.tolist()} - {-1}):
            at_k = due & (self._level == k)
            self._changes[k][:, at_k] = both[:, at_k]
        self._level[due] += 1
        np.copyto(self._mean, mean, where=over_pixels(due, mean.shape[1::-1])[..., None])

    def at(self, film: Film, tile_samples: NDArray[np.int64]) -> float | None:
        """Return the estimated √relMSE of the film with these samples in each tile; None below two samples."""
        limit = film.noise
        if limit is None or not self._changes or self._level.min() < 1:
            return limit
        return min(limit, float(np.sqrt(np.sum(self.tile_errors(tile_samples)) / film.mean.size)))

    def of_tiles(self, tile_samples: NDArray[np.int64], size: tuple[int, int], percent: float | None) -> float | None:
        """Return the percentile of the tiles' √relMSE, for an image of `size`; None if `percent` is None, and before
        all tiles have two samples."""
        if percent is None or not self._changes or self._level.min() < 1:
            return None
        errors = self.tile_errors(tile_samples) / (3 * tile_pixels(size))
        return float(np.sqrt(np.percentile(errors, percent, method="higher")))

    def tile_errors(self, tile_samples: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return (rows, columns), estimated sums over a tile's values of squared error / (expected² + 0.01).

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
        """Return V(n/2)/V(n) at n = 2^level, over all tiles that have reached it."""
        steps = min(level - 1, STEPS)
        now, earlier = self._changes[level - 1], self._changes[level - 1 - steps]
        known = np.isfinite(now + earlier).all(axis=0)  # not where a sample was dropped before there were others
        (changes, variance), (changes_then, variance_then) = now[:, known], earlier[:, known]
        if np.sum(changes) <= 0 or 1 << level > self._planned:
            return LEAST_FALL
        if level < 2:
            return FIRST_FALL
        fallen = _log_ratio(changes_then, changes) + _log_ratio(variance, variance_then)
        faster = min(max(fallen / steps, 0.0), log(MOST_FALL / LEAST_FALL))
        by_chance = _squared_error_of_log_ratio(changes_then, changes) / steps**2
        lasting = LASTING * (1 - by_chance / faster**2) if faster**2 > by_chance else 0.0
        return LEAST_FALL * exp(lasting * faster)


def _log_ratio(above: NDArray[np.float64], below: NDArray[np.float64]) -> float:
    """Return log(Σ above / Σ below), where either may be 0 or tiny."""
    return log(max(float(np.sum(above)), TINY)) - log(max(float(np.sum(below)), TINY))


def _squared_error_of_log_ratio(above: NDArray[np.float64], below: NDArray[np.float64]) -> float:
    """Return the squared standard error of log(Σ above / Σ below), for tiles assumed to be independent (by the delta
    method; the samples' variances are assumed to be exact); infinite if there is only one tile."""
    parts = above / max(np.sum(above), TINY) - below / np.sum(below)
    return float(np.sum(parts**2) * parts.size / (parts.size - 1)) if parts.size > 1 else np.inf
