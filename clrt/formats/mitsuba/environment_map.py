"""Mitsuba's environment maps, resampled to clrt's rows and axis."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...scene.model import Environment, FloatArray
from ..images.image_reader import read_picture
from ..images.turned_environment import TURN, interpolated, resampled, turned_about_y
from ..scene_parts.notes import Notes
from .values import Doubles
from .xml import Plugin

#: Minimum number of rows of an environment map, which is upsampled by an integer factor.
ROWS = 1024
#: Maximum number of rows that a rotated one is upsampled to, twice its own.
MOST_ROWS = 2048


def environment_map(plugin: Plugin, notes: Notes) -> Environment:
    """Read an envmap emitter."""
    plugin.used.add("mis_compensation")
    image = read_picture(Path(plugin.value("filename", str, "")))
    strength, linear = plugin.value("scale", float, 1.0), plugin.transform("to_world")[:3, :3]
    size = float(np.cbrt(abs(np.linalg.det(linear))))
    if not size or np.abs(linear.T @ linear / size**2 - np.eye(3)).max() > TURN:
        plugin.refuse("its to_world stretches or shears", "only rotate or mirror it", "envmap that is stretched")
    turn = linear / size
    if (angle := turned_about_y(turn)) is not None:
        return Environment(image=rows_at_middles(image), strength=strength, rotation_degrees=angle)
    notes.differ(plugin, "is mirrored, or rotated about another axis than y, and resampled")
    return Environment(image=turned_map(image, turn), strength=strength)


def turned_map(image: FloatArray, turn: Doubles) -> FloatArray:
    """Return an environment map (h, w, 3) of Mitsuba's as one of clrt's that is not turned. turn: see `resampled`."""
    rows, columns = image.shape[:2]

    def lookup(u: Doubles, v: Doubles) -> Doubles:
        return interpolated(image, u * columns - 0.5, v * (rows - 1))  # the first and last rows are the poles

    return resampled(lookup, turn, max(ROWS, min(2 * rows, MOST_ROWS), rows))


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
