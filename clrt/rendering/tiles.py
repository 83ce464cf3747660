"""The squares of pixels in which a picture is rendered, and in which its error is told and lessened."""

from __future__ import annotations

from math import gcd
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Pixels along the side of a square. All lanes of a work-item are of one.
TILE = 8
TILE_PIXELS = TILE * TILE
#: Tiles in a row that are rendered one after another, since their rays meet the same parts of a tree: by single ones a
#: large mesh takes a tenth longer.
RUN = 128


def tiles_of(size: tuple[int, int]) -> tuple[int, int]:
    """How many rows and columns of tiles cover a picture of (width, height)."""
    width, height = size
    return -(-height // TILE), -(-width // TILE)


def tile_pixels(size: tuple[int, int]) -> NDArray[np.int64]:
    """(rows, columns) pixels of each tile, fewer where the picture ends."""
    rows, columns = (np.minimum(TILE, extent - np.arange(0, extent, TILE)) for extent in size[::-1])
    return np.outer(rows, columns)


def mean_samples(tile_samples: NDArray[np.int64], size: tuple[int, int]) -> int:
    """Samples a pixel of a picture of (width, height), the mean over all, rounded."""
    width, height = size
    return round(int(np.sum(tile_samples * tile_pixels(size))) / (width * height))


def tile_sums(values: NDArray[np.floating[Any]]) -> NDArray[np.float64]:
    """(rows, columns) sums over the tiles of values (height, width) or (height, width, k)."""
    (height, width), pixels = values.shape[:2], values if values.ndim == 2 else values.sum(axis=2, dtype=np.float64)
    rows = np.add.reduceat(pixels, np.arange(0, height, TILE), axis=0, dtype=np.float64)
    return np.asarray(np.add.reduceat(rows, np.arange(0, width, TILE), axis=1))


def scattered(count: int) -> NDArray[np.intp]:
    """The numbers 0 … count − 1 in an order of which every long stretch is spread evenly over them all.

    Runs of RUN stay together; they follow each other by the golden ratio of their count (the three-distance theorem
    bounds the gaps of a stretch). The first is in the middle, where a picture is seldom cheaper than elsewhere, as the
    next launch's size is chosen by it.
    """
    runs = -(-count // RUN)
    step = max(1, round(runs * (5**0.5 - 1) / 2))
    while gcd(step, runs) > 1:
        step += 1
    order = ((np.arange(runs) * step + runs // 2) % runs)[:, None] * RUN + np.arange(RUN)
    return order[order < count]


def tile_by_tile(values: NDArray[Any]) -> NDArray[Any]:
    """(tiles, TILE_PIXELS): the pixels of each tile row by row, of values (height, width); zeros beyond the picture."""
    (height, width), (rows, columns) = values.shape, tiles_of(values.shape[::-1])
    whole = np.zeros((rows * TILE, columns * TILE), values.dtype)
    whole[:height, :width] = values
    return whole.reshape(rows, TILE, columns, TILE).swapaxes(1, 2).reshape(-1, TILE_PIXELS)


def row_by_row(values: NDArray[Any], size: tuple[int, int]) -> NDArray[Any]:
    """(height, width), of what `tile_by_tile` gave."""
    (width, height), (rows, columns) = size, tiles_of(size)
    whole = values.reshape(rows, columns, TILE, TILE).swapaxes(1, 2).reshape(rows * TILE, columns * TILE)
    return np.ascontiguousarray(whole[:height, :width])


def over_pixels(values: NDArray[Any], size: tuple[int, int]) -> NDArray[Any]:
    """(height, width): for each pixel its tile's value, of values (rows, columns)."""
    width, height = size
    return np.repeat(np.repeat(values, TILE, axis=0)[:height], TILE, axis=1)[:, :width]
