"""The conversions of materials by pbrt's names, and stand-ins for those that clrt lacks."""

from __future__ import annotations

from ...scene.materials.material_types import Diffuse, Material
from . import surfaces as v4, surfaces_v3 as v3
from .entities import Entity
from .materials import Convert, MaterialReader

#: Parameters that are a surface's color, in the order in which they are looked for.
COLORS = ("reflectance", "Kd", "color", "Kr")


def unknown(reader: MaterialReader, entity: Entity) -> Material:
    """Replace any material by a diffuse one of its color."""
    known = ", ".join(TYPES)
    what = f'material "{entity.kind}" is not supported'
    reader.notes.instead(entity, what, f"use one of {known}", "a diffuse surface is used")
    name = next((each for each in COLORS if each in entity.parameters), COLORS[0])
    color = reader.textures.color(entity, name, 0.5)
    entity.ignore()
    return Diffuse(color=color)


TYPES: dict[str, Convert] = {
    "diffuse": v4.diffuse,
    "coateddiffuse": v4.coated_diffuse,
    "conductor": v4.conductor,
    "coatedconductor": v4.coated_conductor,
    "dielectric": v4.dielectric,
    "thindielectric": v4.thin_dielectric,
    "diffusetransmission": v4.diffuse_transmission,
    "mix": v4.mix,
    **dict.fromkeys(("interface", "none", ""), v4.interface),
    "matte": v3.matte,
    "plastic": v3.plastic,
    "metal": v3.metal,
    "mirror": v3.mirror,
    "glass": v3.glass,
    "uber": v3.uber,
    "substrate": v3.substrate,
    "translucent": v3.translucent,
    "disney": v3.disney,
}
