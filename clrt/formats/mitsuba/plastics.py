"""Conversion of Mitsuba's plastics."""

from __future__ import annotations

from ...scene.materials.plastic import Plastic
from ...scene.materials.textures import Texture
from ..scene_parts.texture_images import mean_of
from .bsdfs import distribution_of, index, roughness_of
from .materials import MaterialReader, ShapeMaterial
from .xml import Plugin


def plastic(reader: MaterialReader, plugin: Plugin) -> ShapeMaterial:
    """Convert plastic and roughplastic."""
    ior = index(plugin, "int_ior", "polypropylene") / index(plugin, "ext_ior", "air")
    if ior < 1:
        plugin.refuse("is less dense than its surroundings", "write an int_ior above ext_ior", "plastic, ior below 1")
    if plugin.kind == "plastic":
        reader.notes.differ(plugin, "smooth plastic has alpha 0.0001, and reflects point-like lights")
    return ShapeMaterial(
        Plastic(
            color=reader.color(plugin, "diffuse_reflectance", 0.5),
            ior=ior,
            roughness=_roughness(reader, plugin) if plugin.kind == "roughplastic" else 0.0,
            specular=reader.color(plugin, "specular_reflectance", 1.0),
            distribution=distribution_of(reader, plugin) if plugin.kind == "roughplastic" else "ggx",
            nonlinear=plugin.value("nonlinear", bool, False),
        )
    )


def _roughness(reader: MaterialReader, plugin: Plugin) -> float:
    roughness = roughness_of(reader, plugin)
    if isinstance(roughness, Texture):
        what = "alpha is a texture"
        reader.notes.instead(plugin, what, "write a number", "its mean is used", "roughplastic, textured alpha")
    return mean_of(roughness)
