"""Stand-ins for BSDFs that clrt lacks, used with `approximate` only."""

from __future__ import annotations

from typing import Any

from ...scene.materials.material_types import Diffuse, Phong
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
    "coating": nested,
    "roughcoating": nested,
    "mixturebsdf": nested,
}
