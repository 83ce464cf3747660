"""The squares of pixels in which a picture is rendered, and in which its error is told and lessened."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Pixels along the side of a square. All lanes of a work-item are of one.
TILE = 8
TILE_PIXELS = TILE * TILE


def tiles_of(size: tuple[int, int]) -> tuple[int, int]:
    """How many rows and columns of tiles cover a picture of (width, height)."""
    width, height = size
    return -(-height // TILE), -(-width // TILE)


def tile_pixels(size: tuple[int, int]) -> NDArray[np.int64]:
    """(rows, columns) pixels of each tile, fewer where the picture ends."""
    rows, columns = (np.minimum(TILE, extent - np.arange(0, extent, TILE)) for extent in size[::-1])
    return np.outer(rows, columns)


def tile_sums(values: NDArray[np.floating[Any]]) -> NDArray[np.float64]:
    """(rows, columns) sums over the tiles of values (height, width) or (height, width, k)."""
    height, width = values.shape[:2]
    rows = np.add.reduceat(values, np.arange(0, height, TILE), axis=0, dtype=np.float64)
    sums = np.add.reduceat(rows, np.arange(0, width, TILE), axis=1)
    return np.asarray(sums if values.ndim == 2 else sums.sum(axis=2))


def over_pixels(values: NDArray[Any], size: tuple[int, int]) -> NDArray[Any]:
    """(height, width): for each pixel its tile's value, of values (rows, columns)."""
    width, height = size
    return np.repeat(np.repeat(values, TILE, axis=0)[:height], TILE, axis=1)[:, :width]
