"""Stand-ins for BSDFs that clrt lacks, used with `approximate` only."""

from __future__ import annotations

from math import sqrt
from typing import Any

from ...scene.materials.material_types import Diffuse, MetallicRoughness, Phong
from ...scene.materials.textures import Texture
from .materials import Convert, MaterialReader, ShapeMaterial
from .xml import Plugin

#: Parameters of BSDFs that are a surface's color, in the order in which they are looked for.
COLORS = ("base_color", "diffuse_reflectance", "reflectance")


def unknown(reader: MaterialReader, plugin: Plugin) -> ShapeMaterial:
    """Replace any BSDF by a diffuse one of its color."""
    reader.notes.instead(
        plugin,
        f'bsdf type "{plugin.kind}" is not supported',
        f"use one of {', '.join(name for name in reader.types if name not in STAND_INS)}",
        "a diffuse surface is used",
    )
    plugin.ignore()
    return ShapeMaterial(Diffuse(color=_color(reader, plugin)))


def nested(reader: MaterialReader, plugin: Plugin) -> ShapeMaterial:
    """Replace a BSDF that changes another one by that one, of several by the first."""
    inner = plugin.all("bsdf")
    if not inner:
        return unknown(reader, plugin)
    reader.notes.instead(
        plugin, f'bsdf type "{plugin.kind}" is not supported', "write the BSDF inside it", "the BSDF inside it is used"
    )
    plugin.ignore()
    return reader.look(inner[0])


def principled(reader: MaterialReader, plugin: Plugin) -> ShapeMaterial:
    """Replace Disney's BSDF by glTF's; anisotropy, flatness and transmission are left out."""
    reader.notes.instead(
        plugin,
        f'bsdf type "{plugin.kind}" is not supported',
        "use roughplastic or roughconductor",
        "metallic_roughness is used, without anisotropy and transmission",
    )
    plugin.ignore()
    # specular 0.5, the default, is an index of 1.5
    amount = min(max(plugin.value("specular", float, 0.5), 0.0), 1.0)
    ior = plugin.value("eta", float, 0.0) or 2 / (1 - sqrt(0.08 * amount)) - 1
    gloss = reader.number(plugin, "clearcoat_gloss", 0.0)
    return ShapeMaterial(
        MetallicRoughness(
            color=_color(reader, plugin),
            metallic=reader.number(plugin, "metallic", 0.0),
            roughness=reader.number(plugin, "roughness", 0.5),
            ior=min(max(ior, 1.0), 4.0),
            clearcoat=reader.number(plugin, "clearcoat", 0.0),
            # alpha from 0.1 to 0.001
            clearcoat_roughness=sqrt(0.1 - 0.099 * (0.5 if isinstance(gloss, Texture) else gloss)),
        )
    )


def phong(reader: MaterialReader, plugin: Plugin) -> ShapeMaterial:
    """Convert Mitsuba 0.x's Phong model, which clrt has as well."""
    return ShapeMaterial(
        Phong(
            color=reader.color(plugin, "diffuse_reflectance", 0.5),
            specular=reader.color(plugin, "specular_reflectance", 0.2),
            shininess=plugin.value("exponent", float, 30.0),
        )
    )


def _color(reader: MaterialReader, plugin: Plugin) -> Any:
    given = {*plugin.values, *dict(plugin.children)}
    return reader.color(plugin, next((name for name in COLORS if name in given), COLORS[-1]), 0.5)


STAND_INS: dict[str, Convert] = {
    "principled": principled,
    "coating": nested,
    "roughcoating": nested,
    "mixturebsdf": nested,
}
