"""Tiles: the squares of pixels that are rendered together, and whose error is estimated and reduced."""

from __future__ import annotations

from math import gcd
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Side length of a tile in pixels. All lanes of a work-item are in the same tile.
TILE = 8
TILE_PIXELS = TILE * TILE
#: Number of consecutive tiles in `scattered` order, whose rays traverse the same parts of a BVH: single tiles make a
#: large mesh a tenth slower.
RUN = 128


def tiles_of(size: tuple[int, int]) -> tuple[int, int]:
    """Return the rows and columns of tiles that cover an image of (width, height)."""
    width, height = size
    return -(-height // TILE), -(-width // TILE)


def tile_pixels(size: tuple[int, int]) -> NDArray[np.int64]:
    """Return (rows, columns), the pixels of each tile, fewer at the image's border."""
    rows, columns = (np.minimum(TILE, extent - np.arange(0, extent, TILE)) for extent in size[::-1])
    return np.outer(rows, columns)


def mean_samples(tile_samples: NDArray[np.int64], size: tuple[int, int]) -> int:
    """Return the samples per pixel of an image of (width, height), averaged over all pixels and rounded."""
    width, height = size
    return round(int(np.sum(tile_samples * tile_pixels(size))) / (width * height))


def tile_sums(values: NDArray[np.floating[Any]]) -> NDArray[np.float64]:
    """Return (rows, columns), sums over the tiles of values (height, width) or (height, width, k)."""
    (height, width), pixels = values.shape[:2], values if values.ndim == 2 else values.sum(axis=2, dtype=np.float64)
    rows = np.add.reduceat(pixels, np.arange(0, height, TILE), axis=0, dtype=np.float64)
    return np.asarray(np.add.reduceat(rows, np.arange(0, width, TILE), axis=1))


def scattered(count: int) -> NDArray[np.intp]:
    """Return the numbers 0 … count − 1 in an order in which every long range is evenly distributed over all of them.

    Runs of RUN stay together; they follow each other by the golden ratio of their count (the three-distance theorem
    bounds the gaps of a range). The first is in the middle of the image, which is rarely cheaper than the rest, as the
    size of the next launch is derived from it.
    """
    runs = -(-count // RUN)
    step = max(1, round(runs * (5**0.5 - 1) / 2))
    while gcd(step, runs) > 1:
        step += 1
    order = ((np.arange(runs) * step + runs // 2) % runs)[:, None] * RUN + np.arange(RUN)
    return order[order < count]


def tile_by_tile(values: NDArray[Any]) -> NDArray[Any]:
    """Return (tiles, TILE_PIXELS), each tile's pixels row by row, of values (height, width); 0 outside the image."""
    (height, width), (rows, columns) = values.shape, tiles_of(values.shape[::-1])
    whole = np.zeros((rows * TILE, columns * TILE), values.dtype)
    whole[:height, :width] = values
    return whole.reshape(rows, TILE, columns, TILE).swapaxes(1, 2).reshape(-1, TILE_PIXELS)


def row_by_row(values: NDArray[Any], size: tuple[int, int]) -> NDArray[Any]:
    """Return (height, width), the inverse of `tile_by_tile`."""
    (width, height), (rows, columns) = size, tiles_of(size)
    whole = values.reshape(rows, columns, TILE, TILE).swapaxes(1, 2).reshape(rows * TILE, columns * TILE)
    return np.ascontiguousarray(whole[:height, :width])


def over_pixels(values: NDArray[Any], size: tuple[int, int]) -> NDArray[Any]:
    """Return (height, width), for each pixel its tile's value, given values (rows, columns)."""
    width, height = size
    return np.repeat(np.repeat(values, TILE, axis=0)[:height], TILE, axis=1)[:, :width]
