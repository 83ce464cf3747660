"""Mitsuba's emitters without a shape: point, spot, directional and constant."""

from __future__ import annotations

from ...scene.lights import DirectionalLight, Light, PointLight, SpotLight
from ...scene.model import Environment
from ..scene_parts.notes import Notes
from .environment_map import environment_map
from .values import rgb
from .xml import Plugin

#: Emitters that are the environment, and those of shapes, which at the top of a file are only referred to.
ENVIRONMENTS = ("constant", "envmap")
OF_SHAPES = ("area",)


def light(plugin: Plugin, notes: Notes) -> Light | None:
    """Read a point, spot or directional light. Raises UnsupportedError for others; None if they may be left out."""
    to_world = plugin.transform("to_world")
    plugin.used |= {"to_world", "sampling_weight"}
    if plugin.kind == "point":
        x, y, z = plugin.point("position") or to_world[:3, 3].tolist()
        return PointLight(position=(x, y, z), intensity=rgb(plugin.color("intensity", 1.0), emitted=True))
    if plugin.kind == "directional":
        x, y, z = plugin.point("direction") or to_world[:3, 2].tolist()
        return DirectionalLight(direction=(x, y, z), irradiance=rgb(plugin.color("irradiance", 1.0), emitted=True))
    if plugin.kind == "spot":
        return _spot(plugin, notes)
    known = "point, spot, directional, constant, envmap, or area on a shape"
    what = f'emitter type "{plugin.kind}" is not supported'
    plugin.ignore()
    notes.instead(plugin, what, f"use {known}", "it is left out")
    return None


def _spot(plugin: Plugin, notes: Notes) -> SpotLight:
    to_world = plugin.transform("to_world")
    (x, y, z), (dx, dy, dz) = to_world[:3, 3].tolist(), to_world[:3, 2].tolist()
    outer = plugin.value("cutoff_angle", float, 20.0)
    inner = plugin.value("beam_width", float, 0.75 * outer)
    if plugin.child("texture") is not None:
        notes.instead(plugin, "has a texture", "leave it out", "it is left out", "spot, texture")
    return SpotLight(
        position=(x, y, z),
        direction=(dx, dy, dz),
        intensity=rgb(plugin.color("intensity", 1.0), emitted=True),
        inner_degrees=inner,
        outer_degrees=outer,
        falloff="angle",
    )


def environment(plugin: Plugin, notes: Notes) -> Environment:
    """Read a constant or envmap emitter as the environment."""
    plugin.used.add("sampling_weight")
    if plugin.kind == "constant":
        return Environment(color=rgb(plugin.color("radiance", 1.0), emitted=True))
    return environment_map(plugin, notes)
