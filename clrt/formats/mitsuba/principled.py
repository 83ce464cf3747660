"""Conversion of Mitsuba's principled BSDF."""

from __future__ import annotations

from math import sqrt
from typing import Any

from ...scene.materials.principled import Principled
from .materials import WHITE, MaterialReader, ShapeMaterial
from .textures import Attribute
from .xml import Plugin

#: Numbers and textures that have the same names in both.
NUMBERS = {
    "metallic": 0.0,
    "roughness": 0.5,
    "spec_tint": 0.0,
    "spec_trans": 0.0,
    "anisotropic": 0.0,
    "sheen": 0.0,
    "sheen_tint": 0.0,
    "flatness": 0.0,
    "clearcoat": 0.0,
    "clearcoat_gloss": 0.0,
}
#: Parameters that change the noise alone.
RATES = ("main_specular_sampling_rate", "clearcoat_sampling_rate", "diffuse_reflectance_sampling_rate")
#: Mitsuba's replacements of an index or specular reflectance that refracts nothing, on surfaces that transmit light.
LEAST_ETA, LEAST_SPECULAR = 1.001, 1e-3


def principled(reader: MaterialReader, plugin: Plugin) -> ShapeMaterial:
    plugin.used.update(RATES)
    numbers: dict[str, Any] = {name: reader.number(plugin, name, usual) for name, usual in NUMBERS.items()}
    color = reader.textures.color(plugin, "base_color", 0.5)
    is_attribute = isinstance(color, Attribute)
    material = Principled(
        color=WHITE if is_attribute else color, ior=_index(plugin, numbers["spec_trans"] != 0), **numbers
    )
    return ShapeMaterial(material, color if is_attribute else None)


def _index(plugin: Plugin, transmits: bool) -> float:
    """Return the index of refraction, given as `eta`, or by `specular`, a reflectance at normal incidence over 0.08."""
    if {"eta", "specular"} <= {*plugin.values}:
        plugin.refuse("has eta and specular", "write one of them", "principled with eta and specular")
    if "eta" in plugin.values:
        eta = plugin.value("eta", float, 1.5)
        return LEAST_ETA if transmits and eta == 1 else eta
    specular = plugin.value("specular", float, 0.5)
    if not 0 <= specular <= 1:
        plugin.refuse(f"specular is {specular:g}", "write a number from 0 to 1, or eta", "principled, specular")
    return 2 / (1 - sqrt(0.08 * (specular or LEAST_SPECULAR * transmits))) - 1
