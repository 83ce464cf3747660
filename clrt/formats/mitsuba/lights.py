"""Mitsuba's emitters without a shape: point, spot, projector, directional and constant."""

from __future__ import annotations

from dataclasses import replace
from math import atan, degrees, pi, radians, tan

import numpy as np

from ...scene.lights import DirectionalLight, Light, PointLight, ProjectorLight, SpotLight
from ...scene.model import Environment
from ..scene_parts.camera_axes import lengths_of
from ..scene_parts.light_axes import oriented
from ..scene_parts.notes import Notes
from .camera import vertical_fov
from .environment_map import environment_map
from .textures import TextureReader
from .values import rgb
from .xml import Plugin

#: Emitters that are the environment, and those of shapes, which at the top of a file are only referred to.
ENVIRONMENTS = ("constant", "envmap")
OF_SHAPES = ("area",)


def light(plugin: Plugin, textures: TextureReader, notes: Notes) -> Light | None:
    """Read a point, spot, projector or directional light. Raises UnsupportedError for others; None if they may be left
    out."""
    to_world = plugin.transform("to_world")
    plugin.used |= {"to_world", "sampling_weight"}
    if plugin.kind == "point":
        x, y, z = plugin.point("position") or to_world[:3, 3].tolist()
        return PointLight(position=(x, y, z), intensity=rgb(plugin.color("intensity", 1.0), emitted=True))
    if plugin.kind == "directional":
        x, y, z = plugin.point("direction") or to_world[:3, 2].tolist()
        return DirectionalLight(direction=(x, y, z), irradiance=rgb(plugin.color("irradiance", 1.0), emitted=True))
    if plugin.kind == "spot":
        return _spot(plugin, textures)
    if plugin.kind == "projector":
        return _projector(plugin, textures)
    known = "point, spot, projector, directional, constant, envmap, or area on a shape"
    what = f'emitter type "{plugin.kind}" is not supported'
    plugin.ignore()
    notes.instead(plugin, what, f"use {known}", "it is left out")
    return None


def _spot(plugin: Plugin, textures: TextureReader) -> SpotLight:
    to_world = plugin.transform("to_world")
    (x, y, z), (dx, dy, dz) = to_world[:3, 3].tolist(), to_world[:3, 2].tolist()
    outer = plugin.value("cutoff_angle", float, 20.0)
    inner = plugin.value("beam_width", float, 0.75 * outer)
    spot = SpotLight(
        position=(x, y, z),
        direction=(dx, dy, dz),
        intensity=rgb(plugin.color("intensity", 1.0), emitted=True),
        inner_degrees=inner,
        outer_degrees=outer,
        falloff="angle",
    )
    image = textures.light_image(plugin, "texture")
    if image is None:
        return spot
    axes = to_world[:3, :3] / lengths_of(plugin, to_world[:3, :3], "its to_world", "spot")
    return replace(spot, **oriented(image, axes[:, 0], -axes[:, 1], axes[:, 2]))


def _projector(plugin: Plugin, textures: TextureReader) -> ProjectorLight:
    """Read a projector: at z = 1 in its coordinates, a white pixel is pi times `scale` in irradiance."""
    to_world = plugin.transform("to_world")
    across, _, along = lengths_of(plugin, to_world[:3, :3], "its to_world", "projector")
    image = textures.light_image(plugin, "irradiance")
    color = (1.0, 1.0, 1.0) if image else rgb(plugin.color("irradiance", 1.0), emitted=True)
    fov = vertical_fov(plugin, image.aspect if image else 1.0)
    red, green, blue = (pi * plugin.value("scale", float, 1.0) * along * np.array(color)).tolist()
    right, top, forward = (to_world[:3, :3] / np.linalg.norm(to_world[:3, :3], axis=0)).T
    x, y, z = to_world[:3, 3].tolist()
    return ProjectorLight(
        position=(x, y, z),
        intensity=(red, green, blue),
        fov_degrees=degrees(2 * atan(tan(radians(fov) / 2) * across / along)),
        **oriented(image, -right, top, forward),
    )


def environment(plugin: Plugin, notes: Notes) -> Environment:
    """Read a constant or envmap emitter as the environment."""
    plugin.used.add("sampling_weight")
    if plugin.kind == "constant":
        return Environment(color=rgb(plugin.color("radiance", 1.0), emitted=True))
    return environment_map(plugin, notes)
