"""Mitsuba's plastics: a dielectric coat over a diffuse base, which is `metallic_roughness` with the albedo coupling.

With T = 1 − E for the coat's albedo E, Mitsuba's base is color·T(wi)·T(wo)/(π·ior²·(1 − r)), where r is the reflectance
of the coat for diffuse light from inside. Reciprocity gives ior²·(1 − r) = 1 − mean E, the denominator of the coupling.
"""

from __future__ import annotations

import numpy as np

from ...scene.materials.material_types import MetallicRoughness
from ...scene.materials.textures import Texture
from .bsdfs import index, roughness_of
from .materials import MaterialReader, ShapeMaterial
from .textures import Doubles
from .xml import Plugin


def plastic(reader: MaterialReader, plugin: Plugin) -> ShapeMaterial:
    """Convert plastic and roughplastic."""
    ior = index(plugin, "int_ior", "polypropylene") / index(plugin, "ext_ior", "air")
    if ior < 1:
        plugin.refuse("is less dense than its surroundings", "write an int_ior above ext_ior", "plastic, ior below 1")
    reader.white(plugin, "specular_reflectance")
    color = reader.color(plugin, "diffuse_reflectance", 0.5)
    if plugin.value("nonlinear", bool, False):
        inside = internal_reflectance(ior)

        def saturated(base: Doubles) -> Doubles:
            return base * (1 - inside) / (1 - base * inside)

        if isinstance(color, Texture):
            color = reader.textures.baked(color, "color", saturated)
        else:
            red, green, blue = saturated(np.array(color)).tolist()
            color = red, green, blue
    roughness = roughness_of(reader, plugin) if plugin.kind == "roughplastic" else 0.0
    reader.notes.differ(plugin, "plastic with Schlick's Fresnel term, Mitsuba's is exact")
    return ShapeMaterial(
        MetallicRoughness(
            color=color, ior=ior, roughness=roughness, smith="separable", coupling="albedo", multiple_scattering=False
        )
    )


def internal_reflectance(ior: float) -> float:
    """Return the reflectance of a smooth dielectric for diffuse light from inside: the integral of Fresnel's equations,
    2·F·cos over the cosine, from outside, turned around by reciprocity."""
    node, weight = np.polynomial.legendre.leggauss(64)
    cos_i = (node + 1) / 2
    cos_t = np.sqrt(1 - (1 - cos_i**2) / ior**2)
    across, along = (cos_i - ior * cos_t) / (cos_i + ior * cos_t), (ior * cos_i - cos_t) / (ior * cos_i + cos_t)
    outside = float(weight @ ((across**2 + along**2) / 2 * cos_i))
    return 1 - (1 - outside) / ior**2
