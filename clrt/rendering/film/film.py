"""Accumulated image on the host: mean, error estimate and counts from the device's sums (kernels/film/film.cl)."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..cancellation import NEVER, CancellationToken
from .expected_radiance import REACH, expected
from .row_bands import in_bands
from .tiles import TILE, tile_sums

#: Added to the squared reference in relMSE, so that black pixels do not cause a division by zero.
RELATIVE_FLOOR = 0.01


def _in_planes(values: NDArray[Any]) -> NDArray[Any]:
    """Return (3, height, width) as a view of shape (height, width, 3), keeping the planar memory layout: numpy's inner
    loops then run over rows instead of three values."""
    return np.moveaxis(values, 0, -1)


def _sums(pixels: NDArray[Any], name: str) -> NDArray[np.float64]:
    total = np.moveaxis(pixels[name], -1, 0).astype(np.float64, order="C")
    total += np.moveaxis(pixels[f"{name}_error"], -1, 0)
    return _in_planes(total)


def _lit_parts(pixels: NDArray[Any]) -> NDArray[np.float64]:
    """Return (height, width, 3): a catcher's light with the objects over that without, at most 1."""
    caught, bare = _sums(pixels, "caught"), _sums(pixels, "bare")
    return np.asarray(np.divide(caught, bare, out=np.ones_like(bare), where=bare > 0).clip(0, 1))


def _padded(values: NDArray[np.float64], rows: tuple[int, int]) -> NDArray[np.float64]:
    """Pad with REACH columns on both sides and `rows` rows above and below, replicating the edge."""
    return _in_planes(np.pad(np.moveaxis(values, -1, 0), [(0, 0), rows, (REACH, REACH)], "edge"))


class Film:
    """Host copy of the device's film. pixels: (height, width) records of a `pixel_record`; backdrop: (height, width, 3)
    or (1, 1, 3), what is behind the scene, if that is part of the image; only if the film stores coverage."""

    def __init__(self, pixels: NDArray[Any], backdrop: NDArray[np.float32] | None = None) -> None:
        self.pixels, self.backdrop = pixels, backdrop
        self._relative: tuple[NDArray[np.float32], NDArray[np.float64]] | None = None

    @property
    def size(self) -> tuple[int, int]:
        """(width, height)."""
        height, width = self.pixels.shape
        return width, height

    @cached_property
    def mean(self) -> NDArray[np.float64]:
        """(height, width, 3): mean of the accepted samples, over the backdrop; 0 where there are none."""
        return self._mean_of("sum")

    @cached_property
    def alpha(self) -> NDArray[np.float64] | None:
        """(height, width): fraction of each pixel that the scene covers, shadows on catchers included; None if the film
        does not store it."""
        if not self._has("alpha"):
            return None
        return 1 - np.concatenate(in_bands(self.pixels.shape, lambda rows: self._open(rows).min(axis=2)))

    def _open(self, rows: slice) -> NDArray[np.float64]:
        """Return (height, width, 3) or (height, width, 1) for these rows: the fraction of what is behind the scene that
        is in the image, by channels if there are catchers, which dim it."""
        pixels = self.pixels[rows]
        total = (pixels["alpha"].astype(np.float64) + pixels["alpha_error"])[..., None]
        if self._has("catcher"):
            count = pixels["catcher"].astype(np.float64) + pixels["catcher_error"]
            total = total + count[..., None] * (1 - _lit_parts(pixels))
        return np.asarray(1 - np.clip(total / np.maximum(pixels["count"], 1)[..., None], 0, 1))

    def _has(self, name: str) -> bool:
        return name in (self.pixels.dtype.names or ())

    @property
    def has_groups(self) -> bool:
        """Whether it stores the light of each light group (rendering/film/group_layers.py)."""
        return self._has("groups")

    @property
    def direct(self) -> NDArray[np.float64]:
        """(height, width, 3): part of the mean due to path depths 1 and 2; only if the film stores it separately."""
        return self._mean_of("direct")

    def picture(self) -> NDArray[np.float32]:
        """Return (height, width, 3): the mean as displayed and written, row by row in memory."""
        picture = np.empty((*self.pixels.shape, 3), np.float32)
        self._fill_with_mean(picture, "sum")
        return picture

    def _mean_of(self, name: str) -> NDArray[np.float64]:
        mean = _in_planes(np.empty((3, *self.pixels.shape)))
        self._fill_with_mean(mean, name)
        return mean

    def _fill_with_mean(self, mean: NDArray[np.floating[Any]], name: str) -> None:
        def fill(rows: slice) -> None:
            pixels = self.pixels[rows]
            total = _sums(pixels, name)
            if self._has("catcher"):
                total = np.maximum(total - self._dimmed(pixels), 0)
            mean[rows] = total / np.maximum(pixels["count"], 1)[..., None]
            if self.backdrop is not None and self._has("alpha"):
                mean[rows] += self._open(rows) * self._behind(rows)

        in_bands(mean.shape, fill)

    def _dimmed(self, pixels: NDArray[Any]) -> NDArray[np.float64]:
        """Return the sums of catchers' light that the backdrop stands for, dimmed as that is: by channels, or if it is
        not part of the image, equally in all channels, by alpha. The image has the rest."""
        if self.backdrop is not None:
            return np.minimum(_sums(pixels, "caught"), _sums(pixels, "bare"))
        return np.asarray(_lit_parts(pixels).min(axis=2)[..., None] * _sums(pixels, "bare"))

    def _behind(self, rows: slice) -> NDArray[np.float64]:
        """Return the backdrop in these rows."""
        assert self.backdrop is not None
        return (self.backdrop if len(self.backdrop) == 1 else self.backdrop[rows]).astype(np.float64)

    @property
    def variance(self) -> NDArray[np.float64]:
        """(height, width, 3): variance of the mean, i.e. the sample variance over n; NaN below two samples."""
        return np.concatenate(in_bands(self.mean.shape, self._variance))

    def _variance(self, rows: slice) -> NDArray[np.float64]:
        """Return `variance` for these rows; mean², its upper bound, where squares were too large to be summed
        (film/film.cl)."""
        pixels, most = self.pixels[rows], self.mean[rows] ** 2
        count = pixels["count"].astype(np.float64)[..., None]
        with np.errstate(divide="ignore", invalid="ignore"):
            squares = _sums(pixels, "square") / count
            if self.backdrop is not None and self._has("alpha"):  # a sample is covered or not, apart from glass
                squares += self._open(rows) * self._behind(rows) ** 2
            summed = squares >= (1 - 1e-6) * most  # also false for NaN
            variance = np.where(summed, np.maximum(squares - most, 0) / (count - 1), most)
        return np.where(count < 2, np.nan, variance)

    @property
    def relative_to(self) -> NDArray[np.float32]:
        """(height, width, 3): denominator of errors in relMSE, √(expected² + 0.01), with an estimate of the expected
        value (rendering/film/expected_radiance.py)."""
        return self.relative_variance()[0]

    @cached_property
    def noise(self) -> float | None:
        """√relMSE for independent samples: sqrt(mean(Var[mean] / (expected² + 0.01))) over all values.

        None before every pixel has two samples.
        """
        return float(np.sqrt(np.sum(self.tile_limits) / self.mean.size)) if self.has_variance else None

    @cached_property
    def has_variance(self) -> bool:
        """Whether every pixel has two samples."""
        count = self.pixels["count"]
        return bool(count.size) and bool(count.min() >= 2)

    @property
    def tile_limits(self) -> NDArray[np.float64]:
        """(rows, columns): Var[mean] / (expected² + 0.01), summed over a tile's values; NaN below two samples."""
        return self.relative_variance()[1]

    def relative_variance(self, token: CancellationToken = NEVER) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
        """Return `relative_to` and `tile_limits`, computed once, and together since they share intermediate results.
        Raises Cancelled by the token."""
        if self._relative is None:
            self._relative = self._relative_variance(token)
        return self._relative

    def _relative_variance(self, token: CancellationToken) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
        mean, height = self.mean, len(self.mean)
        relative = np.empty_like(mean, np.float32)

        def judge(rows: slice) -> NDArray[np.float64]:
            there = slice(max(rows.start - REACH, 0), min(rows.stop + REACH, height))
            beyond = (there.start - rows.start + REACH, rows.stop + REACH - there.stop)
            variance = self._variance(there)
            squared = expected(_padded(mean[there], beyond), _padded(variance, beyond)) ** 2 + RELATIVE_FLOOR
            relative[rows] = np.sqrt(squared)
            return tile_sums(variance[rows.start - there.start :][: rows.stop - rows.start] / squared)

        return relative, np.concatenate(in_bands(mean.shape, judge, token))

    @property
    def clamped_part(self) -> float:
        """Fraction of all light that clamping removed, as a mean over the image; 0 if it is black."""
        clamped = float(np.mean(self.pixels["clamped"] / np.maximum(self.pixels["count"], 1), dtype=np.float64))
        return clamped / whole if (whole := clamped + float(self.mean.mean())) else 0.0

    @property
    def samples(self) -> int:
        """Number of samples in the film, including dropped ones."""
        return self._totals["count"] + self.nonfinite_samples

    @property
    def tile_samples(self) -> NDArray[np.int64]:
        """(rows, columns): samples per pixel of each tile, taken from its first pixel."""
        pixels = self.pixels[::TILE, ::TILE]
        return np.asarray(pixels["count"] + pixels["dropped"], np.int64)

    @property
    def nonfinite_samples(self) -> int:
        """Number of samples that were dropped because they were NaN or infinite."""
        return self._totals["dropped"]

    @property
    def rays(self) -> int:
        """Number of rays traced; each counter wraps at 2³², long after its image has converged. All rays of a tile may
        be counted in its first pixel (kernels/integrator/wavefront.cl)."""
        return self._totals["rays"]

    @cached_property
    def _totals(self) -> dict[str, int]:
        """Sums of the counters over all pixels, which lie so far apart that one pass over them takes as long as for
        one."""
        names = ("count", "dropped", "rays")
        sums = in_bands(self.pixels.shape, lambda rows: [self.pixels[name][rows].sum(dtype=np.int64) for name in names])
        return dict(zip(names, map(int, np.sum(sums, axis=0))))
