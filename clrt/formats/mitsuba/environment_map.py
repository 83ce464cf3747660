"""Mitsuba's environment maps, resampled to clrt's rows and axis."""

from __future__ import annotations

from math import atan2, degrees
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...scene.model import Environment, FloatArray
from ..images.image_reader import read_picture
from .notes import Notes
from .values import Doubles
from .xml import Plugin

#: Minimum number of rows of an environment map, which is upsampled by an integer factor.
ROWS = 1024
#: Maximum number of rows that a rotated one is upsampled to, twice its own.
MOST_ROWS = 2048
#: Tolerance for an environment's transform to be a rotation about +Y, or a rotation, maybe with a reflection.
TURN = 1e-6


def environment_map(plugin: Plugin, notes: Notes) -> Environment:
    """Read an envmap emitter."""
    plugin.used.add("mis_compensation")
    image = read_picture(Path(plugin.value("filename", str, "")))
    strength, linear = plugin.value("scale", float, 1.0), plugin.transform("to_world")[:3, :3]
    size = float(np.cbrt(abs(np.linalg.det(linear))))
    if not size or np.abs(linear.T @ linear / size**2 - np.eye(3)).max() > TURN:
        plugin.refuse("its to_world stretches or shears", "only rotate or mirror it", "envmap that is stretched")
    turn = linear / size
    angle = atan2(turn[0, 2], turn[0, 0])
    c, s = np.cos(angle), np.sin(angle)
    if np.abs(turn - [[c, 0, s], [0, 1, 0], [-s, 0, c]]).max() <= TURN:
        return Environment(image=rows_at_middles(image), strength=strength, rotation_degrees=degrees(angle))
    notes.differ(plugin, "is mirrored, or rotated about another axis than y, and resampled")
    return Environment(image=resampled(image, turn), strength=strength)


def rows_at_middles(image: FloatArray) -> FloatArray:
    """Resample an environment map, (h, w, 3), to at least ROWS rows by linear interpolation.

    Mitsuba's H rows lie at row/(H − 1) from pole to pole; clrt's h rows at (row + ½)/h.
    """
    cells = len(image) - 1
    if cells < 1:
        return image
    count = cells * -(-ROWS // cells)
    at = (np.arange(count) + 0.5) / count * cells
    above = np.minimum(at.astype(int), cells - 1)
    share = (at - above).astype(np.float32)[:, None, None]
    return np.asarray(image[above] * (1 - share) + image[above + 1] * share, np.float32)


def resampled(image: FloatArray, turn: Doubles) -> FloatArray:
    """Return an environment map (h, w, 3) of Mitsuba's as one of clrt's that is not rotated, by linear interpolation.

    turn: (3, 3), orthogonal, from the map's directions to the world's.
    """
    height = max(ROWS, min(2 * len(image), MOST_ROWS), len(image))
    phi = 2 * np.pi * (np.arange(2 * height) + 0.5) / (2 * height)
    found = np.empty((height, 2 * height, 3), np.float32)
    for row, theta in enumerate(np.pi * (np.arange(height) + 0.5) / height):
        across = np.sin(theta)
        world = np.array([across * np.sin(phi), np.full_like(phi, np.cos(theta)), -across * np.cos(phi)])
        x, y, z = turn.T @ world
        found[row] = _looked_up(image, np.arctan2(x, -z) / (2 * np.pi) % 1, np.arctan2(np.hypot(x, z), y) / np.pi)
    return found


def _looked_up(image: FloatArray, u: Doubles, v: Doubles) -> NDArray[np.float64]:
    """Return the values (n, 3) at coordinates from 0 to 1, where the first and last rows are the poles."""
    height, width = image.shape[:2]
    x, y = u * width - 0.5, v * (height - 1)
    left, above = np.floor(x).astype(int), np.minimum(y.astype(int), max(height - 2, 0))
    below, right = np.minimum(above + 1, height - 1), (left + 1) % width
    across, down = (x - left)[:, None], (y - above)[:, None]
    upper = image[above, left % width] * (1 - across) + image[above, right] * across
    lower = image[below, left % width] * (1 - across) + image[below, right] * across
    return np.asarray(upper * (1 - down) + lower * down)
