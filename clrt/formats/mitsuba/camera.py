"""Conversion of Mitsuba's sensors to cameras."""

from __future__ import annotations

from dataclasses import replace
from math import atan, degrees, hypot, radians, tan

import numpy as np

from ...errors import SceneError
from ...scene.model import Camera
from ..scene_parts.camera_axes import lengths_of
from ..scene_parts.notes import Notes
from .xml import Plugin

#: Default of Mitsuba's camera, and the diagonal in mm of the film that focal_length refers to.
FOCAL_LENGTH, DIAGONAL = "50mm", hypot(36, 24)
#: Ignored parameters.
CLIPPED = {"near_clip", "far_clip"}


def camera_of(plugin: Plugin, size: tuple[int, int], notes: Notes) -> Camera:
    """Read the camera of a sensor with a film of this size."""
    if plugin.kind not in ("perspective", "thinlens", "orthographic"):
        plugin.refuse_kind("perspective, thinlens or orthographic")
    plugin.used |= CLIPPED
    to_world, aspect = plugin.transform("to_world"), size[0] / size[1]
    position, forward, up = (to_world[:3, column] for column in (3, 2, 1))
    lengths = lengths_of(plugin, to_world[:3, :3], "its to_world")
    if np.linalg.det(to_world[:3, :3]) < 0:
        notes.instead(
            plugin,
            "its to_world mirrors the image",
            "only rotate, translate and scale",
            "the image is not mirrored",
            "sensor that mirrors",
        )
    distance = plugin.value("focus_distance", float, 1.0)
    seen = position + distance * forward / lengths[2]
    camera = Camera(position=position.tolist(), look_at=seen.tolist(), up=up.tolist())
    if plugin.kind == "orthographic":
        return replace(camera, projection="orthographic", view_height=2 * lengths[0] / aspect)
    radius = plugin.value("aperture_radius", float, 0.0)
    across, down = (plugin.value(f"principal_point_offset_{axis}", float, 0.0) for axis in "xy")
    return replace(
        camera,
        lens_shift=(across, -down),
        fov_degrees=vertical_fov(plugin, aspect),
        aperture_radius=radius,
        focus_distance=distance if radius else None,
    )


def vertical_fov(plugin: Plugin, aspect: float) -> float:
    """Return the vertical angle in degrees, from `fov` along `fov_axis`, or from `focal_length` on 36 x 24 mm film."""
    axis = plugin.value("fov_axis", str, "x").lower()
    if "fov" in plugin.values:
        spread = tan(radians(plugin.value("fov", float, 0.0)) / 2)
    else:
        text = plugin.value("focal_length", str, FOCAL_LENGTH).removesuffix("mm")
        try:
            spread = DIAGONAL / (2 * float(text))
        except (ValueError, ZeroDivisionError):
            raise SceneError(f'{plugin.at}: focal_length "{text}" is not a length; write it like "50mm"') from None
        axis = "diagonal"
    axis = {"smaller": "y" if aspect > 1 else "x", "larger": "x" if aspect > 1 else "y"}.get(axis, axis)
    shares = {"x": 1 / aspect, "y": 1.0, "diagonal": 1 / hypot(1, aspect)}
    if axis not in shares:
        raise SceneError(f'{plugin.at}: fov_axis "{axis}" is unknown; write x, y, diagonal, smaller or larger')
    return degrees(2 * atan(spread * shares[axis]))
