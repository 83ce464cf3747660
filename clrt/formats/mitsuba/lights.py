"""Mitsuba's emitters without a shape: point, directional, constant and envmap."""

from __future__ import annotations

from math import atan2, degrees
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...scene.lights import DirectionalLight, Light, PointLight
from ...scene.model import Environment
from ..images.image_reader import read_picture
from .values import Doubles, rgb
from .xml import Plugin

#: Minimum number of rows of an environment map, which is upsampled by an integer factor.
ROWS = 1024
#: Tolerance for an environment's transform to be a rotation about +Y.
TURN = 1e-6


def light(plugin: Plugin) -> Light:
    """Read a point or directional light. Raises UnsupportedError for others."""
    if plugin.kind == "point":
        x, y, z = plugin.point("position") or plugin.transform("to_world")[:3, 3].tolist()
        plugin.used.add("to_world")
        return PointLight(position=(x, y, z), intensity=rgb(plugin.color("intensity", 1.0), emitted=True))
    if plugin.kind == "directional":
        x, y, z = plugin.point("direction") or plugin.transform("to_world")[:3, 2].tolist()
        plugin.used.add("to_world")
        return DirectionalLight(direction=(x, y, z), irradiance=rgb(plugin.color("irradiance", 1.0), emitted=True))
    plugin.refuse_kind("point, directional, constant, envmap, or area on a shape")


def environment(plugin: Plugin) -> Environment:
    """Read a constant or envmap emitter as the environment."""
    if plugin.kind == "constant":
        return Environment(color=rgb(plugin.color("radiance", 1.0), emitted=True))
    plugin.used.add("mis_compensation")
    image = rows_at_middles(read_picture(Path(plugin.value("filename", str, ""))))
    return Environment(
        image=image,
        strength=plugin.value("scale", float, 1.0),
        rotation_degrees=_turn(plugin, plugin.transform("to_world")),
    )


def _turn(plugin: Plugin, to_world: Doubles) -> float:
    """Return the rotation about +Y in degrees."""
    angle = atan2(to_world[0, 2], to_world[0, 0])
    c, s = np.cos(angle), np.sin(angle)
    if np.abs(to_world[:3, :3] - [[c, 0, s], [0, 1, 0], [-s, 0, c]]).max() > TURN:
        plugin.refuse(
            "is rotated about an axis other than y",
            "rotate the scene and its camera so that y is up",
            "envmap rotated about x or z",
        )
    return degrees(angle)


def rows_at_middles(image: NDArray[np.float32]) -> NDArray[np.float32]:
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
