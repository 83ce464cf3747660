"""Conversion of Mitsuba's BSDFs to clrt's materials that are the same model, or nearly so.

A surface without `twosided` is black from behind in Mitsuba; here it looks the same from both sides.
"""

from __future__ import annotations

from dataclasses import replace
from math import sqrt

import numpy as np

from ...errors import SceneError
from ...scene.materials.material_types import Conductor, Dielectric, Diffuse, Material, Mirror
from ...scene.materials.plastic import Distribution
from ...scene.materials.textures import Texture
from ..scene_parts.absorbing_glass import absorbing_glass
from ..scene_parts.refractive_indices import DIELECTRICS, METALS, Triple
from .bumps import Bump
from .materials import WHITE, MaterialReader, ShapeMaterial
from .textures import Attribute
from .values import rgb
from .xml import Plugin

#: Indices of a metal that reflects all light to 2e-4, for `material` "none".
PERFECT = (0.01, 0.01, 0.01), (100.0, 100.0, 100.0)


def diffuse(reader: MaterialReader, plugin: Plugin) -> ShapeMaterial:
    color = reader.textures.color(plugin, "reflectance", 0.5)
    if isinstance(color, Attribute):
        return ShapeMaterial(Diffuse(color=WHITE), color)
    return ShapeMaterial(Diffuse(color=color))


def twosided(reader: MaterialReader, plugin: Plugin) -> ShapeMaterial:
    sides = plugin.all("bsdf")
    if len(sides) == 2:
        reader.notes.instead(
            plugin,
            "has two BSDFs",
            "write one for both sides",
            "the first is used on both sides",
            "twosided with two BSDFs",
        )
        return reader.look(sides[0])
    return reader.only(plugin)


def mask(reader: MaterialReader, plugin: Plugin) -> ShapeMaterial:
    opacity = reader.number(plugin, "opacity", 0.5)
    look = reader.only(plugin)
    return look._replace(material=replace(look.material, opacity=opacity))


def bumpmap(reader: MaterialReader, plugin: Plugin) -> ShapeMaterial:
    """Read the heights; the shape that has the BSDF makes a normal map of them."""
    look = _perturbed(reader, plugin, "bump map")
    scale = plugin.value("scale", float, 1.0)
    textures = plugin.all("texture")
    if len(textures) != 1:
        raise SceneError(f"{plugin.at}: contains {len(textures)} textures; write one")
    owner = plugin
    if textures[0].kind == "scale":  # Mitsuba 0.x's
        owner = textures[0]
        scale *= owner.value("scale", float, 1.0)
    heights = reader.textures.heights(owner)
    if "mirror" in heights.wrap:
        plugin.refuse("its texture is mirrored", 'write wrap_mode "repeat" or "clamp"', "bumpmap, mirror")
    return look._replace(bump=Bump(plugin, heights, scale))


def _perturbed(reader: MaterialReader, plugin: Plugin, what: str) -> ShapeMaterial:
    """Return the BSDF within one that perturbs normals, and note how clrt differs."""
    shadowed = plugin.value("use_shadowing_function", bool, True)
    plugin.value("flip_invalid_normals", bool, True)
    look = reader.only(plugin)
    if not (shadowed and type(look.material) is Diffuse):
        reader.notes.differ(plugin, f"{what} that shadows diffuse reflection, and nothing else")
    return look


def normalmap(reader: MaterialReader, plugin: Plugin) -> ShapeMaterial:
    look = _perturbed(reader, plugin, "normal map")
    normals = reader.textures.normals(plugin, "normalmap")
    if not np.allclose(normals.image_axes, np.eye(2)):
        reader.notes.differ(plugin, "a normal map is oriented by its image, rotated by to_uv; in Mitsuba by u")
    return look._replace(material=replace(look.material, normal_map=normals))


def blend(reader: MaterialReader, plugin: Plugin) -> ShapeMaterial:
    """Blend the colors of two untextured diffuse BSDFs by a number or an attribute."""
    weight = reader.textures.number(plugin, "weight", 0.5)
    looks = [reader.look(each) for each in plugin.all("bsdf")]
    if len(looks) != 2:
        raise SceneError(f"{plugin.at}: contains {len(looks)} BSDFs; write two")
    colors = [
        look.material.color
        for look in looks
        if type(look.material) is Diffuse and look == ShapeMaterial(Diffuse(color=look.material.color))
    ]
    if len(colors) != 2 or isinstance(weight, Texture) or any(isinstance(each, Texture) for each in colors):
        reader.notes.instead(
            plugin,
            "blends anything but two uniform diffuse BSDFs",
            "write one BSDF",
            "the one with the larger weight is used",
            "blendbsdf",
        )
        return looks[isinstance(weight, float) and weight > 0.5]
    low, high = (each for each in colors if not isinstance(each, Texture))
    if isinstance(weight, Attribute):
        return ShapeMaterial(Diffuse(color=WHITE), Attribute(weight.name, low, high))
    red, green, blue = (a + weight * (b - a) for a, b in zip(low, high))
    return ShapeMaterial(Diffuse(color=(red, green, blue)))


def dielectric(reader: MaterialReader, plugin: Plugin) -> ShapeMaterial:
    thin, rough = plugin.kind == "thindielectric", plugin.kind == "roughdielectric"
    ior = index(plugin, "int_ior", "bk7") / index(plugin, "ext_ior", "air")
    color = reader.color(plugin, "specular_transmittance", 1.0)
    if thin and color != WHITE:
        reader.notes.differ(plugin, "a tinted sheet absorbs between its faces, too, in Mitsuba only what it transmits")
    glass = Dielectric(ior=ior, color=color, thin=thin, reflectance=reader.color(plugin, "specular_reflectance", 1.0))
    if rough:  # Mitsuba's models single scattering only
        roughness, distribution = roughness_of(reader, plugin), distribution_of(reader, plugin)
        glass = replace(
            glass, roughness=roughness, distribution=distribution, smith="separable", multiple_scattering=False
        )
    return ShapeMaterial(glass)


def conductor(reader: MaterialReader, plugin: Plugin) -> ShapeMaterial:
    name = plugin.value("material", str, "" if {"eta", "k"} & {*plugin.values} else "none")
    color, outside = reader.color(plugin, "specular_reflectance", 1.0), index(plugin, "ext_eta", "vacuum")
    if name == "none" and plugin.kind == "conductor":
        return ShapeMaterial(Mirror(color=color))
    if name not in ("", "none", *METALS):
        plugin.refuse(
            f'material "{name}" is unknown', f"write eta and k, or one of {', '.join(METALS)}", f"metal {name}"
        )
    indices = METALS.get(name, PERFECT) if name else (rgb(plugin.color("eta", 0.0)), rgb(plugin.color("k", 1.0)))
    eta, k = (_limited(parts, 1 / outside, least) for parts, least in zip(indices, (0.01, 0.0)))
    metal = Conductor(eta=eta, k=k, roughness=0.0, reflectance=color)
    if plugin.kind == "conductor":
        reader.notes.differ(plugin, "smooth metal has alpha 0.0001, and reflects point-like lights")
        return ShapeMaterial(metal)
    roughness, across = roughnesses_of(reader, plugin)
    metal = replace(metal, roughness=roughness, roughness_across=across, smith="separable")
    return ShapeMaterial(replace(metal, distribution=distribution_of(reader, plugin)))


def _limited(parts: Triple, factor: float, least: float) -> Triple:
    """Return the numbers times a factor, within what a conductor may have; files have negative ones, too."""
    red, green, blue = (min(max(part * factor, least), 100.0) for part in parts)
    return red, green, blue


def distribution_of(reader: MaterialReader, plugin: Plugin) -> Distribution:
    """Return the microfacets' distribution."""
    distribution = plugin.value("distribution", str, "beckmann")
    if distribution == "beckmann":
        return "beckmann"
    if distribution != "ggx":
        reader.notes.instead(
            plugin,
            f'distribution "{distribution}" is not supported',
            'write "ggx" or "beckmann"',
            "GGX of the same alpha is used",
            f"{plugin.kind}, {distribution}",
        )
    return "ggx"


def roughness_of(reader: MaterialReader, plugin: Plugin) -> float | Texture:
    """Return √alpha of an isotropic distribution."""
    along, across = roughnesses_of(reader, plugin)
    if across is None:
        return along
    reader.notes.instead(
        plugin,
        "alpha differs in u and v",
        "write one number for alpha",
        "their geometric mean is used, or a texture",
        f"{plugin.kind}, anisotropic",
    )
    if isinstance(along, Texture) or isinstance(across, Texture):
        return along if isinstance(along, Texture) else across
    return sqrt(along * across)


def roughnesses_of(reader: MaterialReader, plugin: Plugin) -> tuple[float | Texture, float | Texture | None]:
    """Return √alpha along u, and along v if it differs."""
    plugin.value("sample_visible", bool, True)
    names = ("alpha_u", "alpha_v") if {"alpha_u", "alpha_v"} & {*plugin.values, *dict(plugin.children)} else ("alpha",)
    alphas = [reader.number(plugin, name, 0.1) for name in names]
    along, across = [
        reader.textures.baked(alpha, "number", np.sqrt) if isinstance(alpha, Texture) else sqrt(alpha)
        for alpha in (alphas[0], alphas[-1])
    ]
    return along, None if alphas[0] == alphas[-1] else across


def index(plugin: Plugin, name: str, default: str) -> float:
    """Return an index of refraction, given as a number or as the name of a material."""
    plugin.used.add(name)
    value = plugin.values.get(name, default)
    if isinstance(value, int | float) and value > 0:
        return float(value)
    if not isinstance(value, str) or value.lower() not in DIELECTRICS:
        raise SceneError(
            f'{plugin.at}: {name} "{value}" is unknown; write a positive number or one of {", ".join(DIELECTRICS)}'
        )
    return DIELECTRICS[value.lower()]


def absorbing(material: Material, medium: Plugin) -> Material | None:
    """Return glass with a medium inside that absorbs and does not scatter; None for other materials and media."""
    if (
        not isinstance(material, Dielectric)
        or material.thin
        or medium.kind != "homogeneous"
        or any(rgb(medium.color("albedo", 0.75)))
    ):
        return None
    rates = [rate * medium.value("scale", float, 1.0) for rate in rgb(medium.color("sigma_t", 1.0))]
    return absorbing_glass(material, rates, medium.at)
