"""Padding of the charts in a baked image: texels around them repeat the nearest one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def padded(values: NDArray[np.float32], covered: NDArray[np.bool_], texels: int) -> NDArray[np.float32]:
    """Return values (height, width, c) where each texel at most `texels` from a covered one has the value of the
    nearest. Distances are Euclidean, between centers."""
    height, width = covered.shape
    rows = _nearest_rows(covered)
    away = rows - np.arange(height)[:, None]
    best, source = np.full((height, width), texels**2 + 1), np.full((height, width), -1, np.intp)
    for shift in range(-min(texels, width - 1), min(texels, width - 1) + 1):
        here = slice(max(0, -shift), min(width, width - shift))
        there = slice(max(0, shift), min(width, width + shift))
        squared = np.where(rows[:, there] < 0, texels**2 + 1, away[:, there] ** 2 + shift**2)
        closer = squared < best[:, here]
        best[:, here][closer] = squared[closer]
        source[:, here][closer] = (rows[:, there] * width + np.arange(width)[there])[closer]
    filled, reached = values.copy(), (source >= 0) & ~covered
    filled[reached] = values.reshape(height * width, -1)[source[reached]]
    return filled


def _nearest_rows(covered: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return the row of the nearest covered texel in each texel's own column, −1 if there is none."""
    height = len(covered)
    row = np.broadcast_to(np.arange(height)[:, None], covered.shape)
    above = np.maximum.accumulate(np.where(covered, row, -1), axis=0)
    below = np.minimum.accumulate(np.where(covered, row, 2 * height)[::-1], axis=0)[::-1]
    is_above = (above >= 0) & (row - above <= below - row)
    return np.where(is_above, above, np.where(below < height, below, -1))
