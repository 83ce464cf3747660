"""Axes and units of model files, which scenes have as +Y up and in units of the user's choice."""

from __future__ import annotations

import numpy as np

from ..scene.axes_and_units import METERS, Axis, Unit
from ..scene.geometry.transform import Matrix, scaling


def upright(up: Axis, unit: Unit = "m") -> Matrix:
    """Return the matrix from a file's coordinates, whose axis `up` points up, to ones with +Y up, in meters.

    With +Z up −Y is the front, as in CAD; with +X up +Z is.
    """
    turn = np.eye(4)
    if up == "z":
        turn[1:3, 1:3] = [[0, 1], [-1, 0]]
    elif up == "x":
        turn[:2, :2] = [[0, -1], [1, 0]]
    meters = METERS[unit]
    return turn @ scaling((meters, meters, meters))
