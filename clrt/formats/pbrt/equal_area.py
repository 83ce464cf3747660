"""The equal-area map of the sphere to a square, in which pbrt-v4 stores environment maps.

Clarberg, "Fast equal-area mapping of the (hemi)sphere using SIMD", 2008: a disk of equal area for each hemisphere, and
the square |u| + |v| <= 1 around the pole +z; the corners are folded outward.
"""

from __future__ import annotations

import numpy as np

from ...scene.model import FloatArray
from .tokens import Doubles


def square_of(directions: Doubles) -> Doubles:
    """Return coordinates (n, 2) from 0 to 1 of unit directions (n, 3)."""
    x, y, z = np.abs(directions).T
    radius = np.sqrt(np.maximum(1 - z, 0))
    across = np.arctan2(y, x) * 2 / np.pi * radius
    u, v = radius - across, across
    below = directions[:, 2] < 0
    u, v = np.where(below, 1 - v, u), np.where(below, 1 - u, v)
    return np.asarray(0.5 + 0.5 * np.copysign(np.column_stack([u, v]), directions[:, :2]))


def direction_of(square: Doubles) -> Doubles:
    """Return unit directions (n, 3) of coordinates (n, 2) from 0 to 1."""
    u, v = (2 * square - 1).T
    distance = 1 - (np.abs(u) + np.abs(v))
    radius = 1 - np.abs(distance)
    with np.errstate(invalid="ignore", divide="ignore"):
        turn = np.where(radius > 0, (np.abs(v) - np.abs(u)) / radius + 1, 1.0) * np.pi / 4
    z = np.copysign(1 - radius**2, distance)
    across = radius * np.sqrt(np.maximum(2 - radius**2, 0))
    return np.column_stack([np.copysign(np.cos(turn), u) * across, np.copysign(np.sin(turn), v) * across, z])


def looked_up(image: FloatArray, directions: Doubles) -> Doubles:
    """Interpolate a square map (n, n, 3) linearly in directions (m, 3)."""
    size = len(image)
    x, y = (square_of(directions) * size - 0.5).T
    left, above = np.floor(x).astype(int), np.floor(y).astype(int)
    found = np.zeros((len(directions), 3))
    for column, row in ((0, 0), (1, 0), (0, 1), (1, 1)):
        weight = np.abs(1 - column - (x - left)) * np.abs(1 - row - (y - above))
        found += weight[:, None] * image[_inside(left + column, above + row, size)]
    return found


def _inside(column: Doubles, row: Doubles, size: int) -> tuple[Doubles, Doubles]:
    """Return rows and columns of texels; beyond an edge the neighbor is on the same edge, mirrored."""
    out_x, out_y = (column < 0) | (column >= size), (row < 0) | (row >= size)
    column, row = np.where(out_y, size - 1 - column, column), np.where(out_x, size - 1 - row, row)
    return row.clip(0, size - 1), column.clip(0, size - 1)
