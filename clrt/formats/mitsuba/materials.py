"""Conversion of Mitsuba's BSDFs to clrt's materials if they are the same model; others are rejected by name.

A surface without `twosided` is black from behind in Mitsuba; here it looks the same from both sides.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import exp, sqrt
from typing import Any, NamedTuple

import numpy as np

from ...errors import SceneError
from ...scene.materials.material_types import Conductor, Dielectric, Diffuse, Material, Mirror
from ...scene.materials.textures import Texture
from .refractive_indices import DIELECTRICS, METALS
from .textures import Attribute, TextureReader
from .values import rgb
from .xml import Plugin

#: Largest alpha at which the separable Smith term reduces albedo by less than 4e-4 below the height-correlated one.
NEARLY_SMOOTH = 0.09


class ShapeMaterial(NamedTuple):
    """A material, and the mesh attribute that multiplies its color, if any."""

    material: Material
    attribute: Attribute | None = None


class MaterialReader:
    """Reader for the BSDFs of one scene; shapes that refer to one BSDF share its material.

    differences: how clrt's models differ from Mitsuba's, one sentence each.
    """

    def __init__(self, textures: TextureReader) -> None:
        self._textures = textures
        self._looks: dict[Plugin, ShapeMaterial] = {}
        self.differences: list[str] = []

    def look(self, plugin: Plugin) -> ShapeMaterial:
        """Return the material of a <bsdf>."""
        if plugin not in self._looks:
            if plugin.kind not in BSDFS:
                plugin.refuse_kind(", ".join(sorted(BSDFS)))
            self._looks[plugin] = BSDFS[plugin.kind](self, plugin)
        return self._looks[plugin]

    def _diffuse(self, plugin: Plugin) -> ShapeMaterial:
        color = self._textures.color(plugin, "reflectance", 0.5)
        if isinstance(color, Attribute):
            return ShapeMaterial(Diffuse(color=(1.0, 1.0, 1.0)), color)
        return ShapeMaterial(Diffuse(color=color))

    def _twosided(self, plugin: Plugin) -> ShapeMaterial:
        sides = plugin.all("bsdf")
        if len(sides) != 1:
            plugin.refuse("has two BSDFs", "write one for both sides", "twosided with two BSDFs")
        return self.look(sides[0])

    def _mask(self, plugin: Plugin) -> ShapeMaterial:
        opacity = self._textures.number(plugin, "opacity", 0.5)
        if isinstance(opacity, Attribute):
            plugin.refuse("opacity is an attribute", "write a number or a bitmap", "opacity by a mesh's attribute")
        look = self.look(_only(plugin))
        return look._replace(material=replace(look.material, opacity=opacity))

    def _normalmap(self, plugin: Plugin) -> ShapeMaterial:
        shadowed = plugin.value("use_shadowing_function", bool, True)
        plugin.value("flip_invalid_normals", bool, True)
        look = self.look(_only(plugin))
        if not (shadowed and type(look.material) is Diffuse):
            self.differences.append(f"{plugin.where}: normal map that shadows diffuse reflection, and nothing else")
        normals = self._textures.normals(plugin, "normalmap")
        if not np.allclose(normals.image_axes, np.eye(2)):
            self.differences.append(
                f"{plugin.where}: a normal map is oriented by its image, rotated by to_uv; in Mitsuba by u"
            )
        return look._replace(material=replace(look.material, normal_map=normals))

    def _blend(self, plugin: Plugin) -> ShapeMaterial:
        """Blend the colors of two untextured diffuse BSDFs by a number or an attribute."""
        weight = self._textures.number(plugin, "weight", 0.5)
        colors = [
            look.material.color
            for look in map(self.look, plugin.all("bsdf"))
            if type(look.material) is Diffuse and look == ShapeMaterial(Diffuse(color=look.material.color))
        ]
        if len(colors) != 2 or isinstance(weight, Texture) or any(isinstance(each, Texture) for each in colors):
            plugin.refuse("blends anything but two uniform diffuse BSDFs", "write one BSDF", "blendbsdf")
        low, high = (each for each in colors if not isinstance(each, Texture))
        if isinstance(weight, Attribute):
            return ShapeMaterial(Diffuse(color=(1.0, 1.0, 1.0)), Attribute(weight.name, low, high))
        red, green, blue = (a + weight * (b - a) for a, b in zip(low, high))
        return ShapeMaterial(Diffuse(color=(red, green, blue)))

    def _dielectric(self, plugin: Plugin) -> ShapeMaterial:
        thin, rough = plugin.kind == "thindielectric", plugin.kind == "roughdielectric"
        ior = _index(plugin, "int_ior", "bk7") / _index(plugin, "ext_ior", "air")
        _white(plugin, "specular_reflectance")
        color = self._textures.color(plugin, "specular_transmittance", 1.0)
        roughness = self._roughness(plugin) if rough else 0.0
        return ShapeMaterial(
            Dielectric(ior=ior, color=color, thin=thin, roughness=roughness, multiple_scattering=not rough)
        )  # Mitsuba's models single scattering only

    def _conductor(self, plugin: Plugin) -> ShapeMaterial:
        name = plugin.value("material", str, "" if {"eta", "k"} & {*plugin.values} else "none")
        color = self._textures.color(plugin, "specular_reflectance", 1.0)
        if name == "none" and plugin.kind == "conductor":
            return ShapeMaterial(Mirror(color=color))
        if color != (1.0, 1.0, 1.0):
            plugin.refuse("specular_reflectance is not 1", "leave it out", "specular_reflectance")
        if name and name not in METALS:
            plugin.refuse(
                f'material "{name}" is unknown', f"write eta and k, or one of {', '.join(METALS)}", f"metal {name}"
            )
        eta, k = METALS[name] if name else (rgb(plugin.color("eta", 0.0)), rgb(plugin.color("k", 1.0)))
        if plugin.kind == "roughconductor":
            return ShapeMaterial(Conductor(eta=eta, k=k, roughness=self._roughness(plugin)))
        self.differences.append(f"{plugin.where}: smooth metal has alpha 0.0001, and reflects point-like lights")
        return ShapeMaterial(Conductor(eta=eta, k=k, roughness=0.0))

    def _roughness(self, plugin: Plugin) -> float:
        """Return √alpha of an isotropic GGX distribution."""
        plugin.value("sample_visible", bool, True)
        distribution = plugin.value("distribution", str, "beckmann")
        if distribution != "ggx":
            plugin.refuse(
                f'distribution "{distribution}" is not supported', 'write "ggx"', f"{plugin.kind}, {distribution}"
            )
        names = (
            ("alpha_u", "alpha_v")
            if {"alpha_u", "alpha_v"} & {*plugin.values, *dict(plugin.children)}
            else ("alpha", "alpha")
        )
        alpha, other = (self._textures.number(plugin, name, 0.1) for name in names)
        if isinstance(alpha, (Texture, Attribute)) or alpha != other:
            plugin.refuse(
                "alpha is a texture or differs in u and v",
                "write one number for alpha",
                f"{plugin.kind}, {'anisotropic' if alpha != other else 'textured alpha'}",
            )
        if alpha > NEARLY_SMOOTH:
            self.differences.append(f"{plugin.where}: the height-correlated Smith term, Mitsuba's is separable")
        return sqrt(alpha)


def _only(plugin: Plugin) -> Plugin:
    """Return the one BSDF nested in a BSDF."""
    nested = plugin.all("bsdf")
    if len(nested) != 1:
        raise SceneError(f"{plugin.where}: contains {len(nested)} BSDFs; write one")
    return nested[0]


def _index(plugin: Plugin, name: str, default: str) -> float:
    """Return an index of refraction, given as a number or as the name of a material."""
    plugin.used.add(name)
    value = plugin.values.get(name, default)
    if isinstance(value, (int, float)):
        return float(value)
    if not isinstance(value, str) or value.lower() not in DIELECTRICS:
        raise SceneError(
            f'{plugin.where}: {name} "{value}" is unknown; write a number or one of {", ".join(DIELECTRICS)}'
        )
    return DIELECTRICS[value.lower()]


def _white(plugin: Plugin, name: str) -> None:
    if plugin.child(name) is not None or rgb(plugin.color(name, 1.0)) != (1.0, 1.0, 1.0):
        plugin.refuse(f"{name} is not 1", "leave it out", name)


def absorbing(material: Material, medium: Plugin) -> Material:
    """Return glass with a medium inside that absorbs and does not scatter."""
    if (
        not isinstance(material, Dielectric)
        or material.thin
        or medium.kind != "homogeneous"
        or any(rgb(medium.color("albedo", 0.75)))
    ):
        medium.refuse(
            f"is a {medium.kind} medium that scatters, or is not inside glass", "leave it out", f"{medium.kind} medium"
        )
    rates = [rate * medium.value("scale", float, 1.0) for rate in rgb(medium.color("sigma_t", 1.0))]
    if not (most := max(rates)):
        return material
    red, green, blue = (exp(-rate / most) for rate in rates)
    return replace(material, attenuation_color=(red, green, blue), attenuation_distance=1 / most)


BSDFS: dict[str, Callable[[Any, Plugin], ShapeMaterial]] = {
    "diffuse": MaterialReader._diffuse,
    "twosided": MaterialReader._twosided,
    "mask": MaterialReader._mask,
    "normalmap": MaterialReader._normalmap,
    "blendbsdf": MaterialReader._blend,
    "dielectric": MaterialReader._dielectric,
    "thindielectric": MaterialReader._dielectric,
    "roughdielectric": MaterialReader._dielectric,
    "conductor": MaterialReader._conductor,
    "roughconductor": MaterialReader._conductor,
}
