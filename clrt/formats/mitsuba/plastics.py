"""Mitsuba's plastics: a dielectric coat over a diffuse base, which is `metallic_roughness` with the albedo coupling.

Mitsuba's base is color·T(wi)·T(wo)/(π·ior²·(1 − r)), with the fraction T that the coat transmits and the reflectance r
for diffuse light from inside; the coupling's is color·(1 − E(wi))·(1 − E(wo))/(π·(1 − mean E)), with the coat's albedo
E. For a smooth coat they are equal: T = 1 − E, and ior²·(1 − r) = 1 − mean E by reciprocity. For a rough one Mitsuba's
T and r lack what single scattering loses; the color here is scaled to give the base the same mean reflectance.
"""

from __future__ import annotations

import numpy as np

from ...scene.materials.material_types import MetallicRoughness
from ...scene.materials.textures import Texture
from ..scene_parts.coats import coat
from ..scene_parts.texture_images import mean_of
from .bsdfs import index, roughness_of
from .materials import MaterialReader, ShapeMaterial
from .values import Doubles
from .xml import Plugin


def plastic(reader: MaterialReader, plugin: Plugin) -> ShapeMaterial:
    """Convert plastic and roughplastic."""
    ior = index(plugin, "int_ior", "polypropylene") / index(plugin, "ext_ior", "air")
    if ior < 1:
        plugin.refuse("is less dense than its surroundings", "write an int_ior above ext_ior", "plastic, ior below 1")
    reader.white(plugin, "specular_reflectance")
    color = reader.color(plugin, "diffuse_reflectance", 0.5)
    roughness = roughness_of(reader, plugin) if plugin.kind == "roughplastic" else 0.0
    inside, scale = coat(ior, mean_of(roughness) ** 2, plugin.value("distribution", str, "beckmann"))
    nonlinear = plugin.value("nonlinear", bool, False)

    def scaled(base: Doubles) -> Doubles:
        return np.minimum(base * scale / (1 - (base if nonlinear else 1) * inside), 1)

    if isinstance(color, Texture):
        color = reader.textures.baked(color, "color", scaled)
    else:
        red, green, blue = scaled(np.array(color)).tolist()
        color = red, green, blue
    reader.notes.differ(plugin, "plastic with Schlick's Fresnel term, Mitsuba's is exact")
    return ShapeMaterial(
        MetallicRoughness(
            color=color, ior=ior, roughness=roughness, smith="separable", coupling="albedo", multiple_scattering=False
        )
    )
