"""Layers of an image by light groups, which add up to it exactly."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...scene.light_groups import DEFAULT
from .film import Film
from .row_bands import in_bands

Doubles = NDArray[np.float64]


def group_layers(film: Film, groups: Sequence[str]) -> list[NDArray[np.float32]]:
    """Return the light of each group, (height, width, 3), of a film that stores it. DEFAULT also has what is behind the
    scene, and on catchers.

    The layers' values are multiples of the unit in the last place of the image's value, so all their sums, in any
    order, are exact in float32. What rounding leaves over, a few of these units, is in the brightest group.
    """
    picture = film.picture()
    layers = [np.empty_like(picture) for _ in groups]
    default = groups.index(DEFAULT) if DEFAULT in groups else None

    def fill(rows: slice) -> None:
        pixels = film.pixels[rows]
        means = _means(pixels)
        if default is not None:
            means[default] += film.mean[rows] - _found(pixels)
        for layer, values in zip(layers, shares(picture[rows], means)):
            layer[rows] = values

    in_bands(film.pixels.shape, fill)
    return layers


def shares(whole: NDArray[np.float32], parts: Doubles) -> Doubles:
    """Round parts (groups, …), at least 0 and with about the sum `whole`, so that they add up to it exactly."""
    unit = np.spacing(whole).astype(np.float64)
    counts = np.rint(parts / unit)
    missing = whole / unit - counts.sum(axis=0)
    brightest = counts.argmax(axis=0)[None]
    np.put_along_axis(counts, brightest, np.take_along_axis(counts, brightest, 0) + missing, 0)
    return np.asarray(counts * unit)


def _means(pixels: NDArray[Any]) -> Doubles:
    """Return (groups, height, width, 3): the mean light of each group."""
    sums = np.moveaxis(pixels["groups"].astype(np.float64).sum(axis=3), 2, 0)
    return np.asarray(sums / np.maximum(pixels["count"], 1)[..., None])


def _found(pixels: NDArray[Any]) -> Doubles:
    """Return (height, width, 3): the mean light of the samples that the groups are of, which see no catcher."""
    names = [name for name in ("sum", "caught") if name in (pixels.dtype.names or ())]
    total, *caught = (pixels[name].astype(np.float64) + pixels[f"{name}_error"] for name in names)
    return np.asarray((total - sum(caught)) / np.maximum(pixels["count"], 1)[..., None])
