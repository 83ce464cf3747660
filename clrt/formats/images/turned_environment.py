"""Environment maps whose axes are turned, mirrored or both against the scene's."""

from __future__ import annotations

from collections.abc import Callable
from math import atan2, degrees

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]
#: The values (n, 3) of a map at coordinates from 0 to 1: u from −Z towards +X, v from +Y down.
Lookup = Callable[[Doubles, Doubles], NDArray[np.floating]]
#: Tolerance of a matrix's elements.
TURN = 1e-6


def turned_about_y(turn: Doubles) -> float | None:
    """Return the angle in degrees of a rotation (3, 3) about +Y; None for other matrices."""
    angle = atan2(turn[0, 2], turn[0, 0])
    c, s = np.cos(angle), np.sin(angle)
    return degrees(angle) if np.abs(turn - [[c, 0, s], [0, 1, 0], [-s, 0, c]]).max() <= TURN else None


def resampled(lookup: Lookup, turn: Doubles, height: int) -> NDArray[np.float32]:
    """Return an environment map (height, 2 height, 3) that is not turned.

    turn: (3, 3), orthogonal, from the map's directions to the scene's.
    """
    phi = 2 * np.pi * (np.arange(2 * height) + 0.5) / (2 * height)
    found = np.empty((height, 2 * height, 3), np.float32)
    for row, theta in enumerate(np.pi * (np.arange(height) + 0.5) / height):
        across = np.sin(theta)
        x, y, z = turn.T @ np.array([across * np.sin(phi), np.full_like(phi, np.cos(theta)), -across * np.cos(phi)])
        found[row] = lookup(np.arctan2(x, -z) / (2 * np.pi) % 1, np.arctan2(np.hypot(x, z), y) / np.pi)
    return found


def interpolated(image: NDArray[np.float32], x: Doubles, y: Doubles) -> Doubles:
    """Interpolate an environment map (h, w, 3) linearly at columns x and rows y, (n,): around in x, at the first and
    last row constant in y."""
    height, width = image.shape[:2]
    y = y.clip(0, height - 1)
    left, above = np.floor(x).astype(int), np.minimum(y.astype(int), max(height - 2, 0))
    below, right = np.minimum(above + 1, height - 1), (left + 1) % width
    across, down = (x - left)[:, None], (y - above)[:, None]
    upper = image[above, left % width] * (1 - across) + image[above, right] * across
    lower = image[below, left % width] * (1 - across) + image[below, right] * across
    return np.asarray(upper * (1 - down) + lower * down)
