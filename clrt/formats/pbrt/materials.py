"""Conversion of pbrt's materials, by the functions in material_types.py."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from math import sqrt

import numpy as np

from ...errors import SceneError
from ...scene.materials.material_types import Material
from ...scene.materials.textures import Texture
from ..scene_parts.notes import Notes
from .description import Description
from .entities import Entity
from .textures import TextureReader
from .tokens import Doubles

#: Below this alpha pbrt's surfaces are smooth.
SMOOTH = 1e-3
#: Coefficients of the polynomial of ln(roughness) by which v3 computes alpha, and the least roughness.
REMAP, LEAST = (0.000640711, 0.0171201, 0.1734, 0.819955, 1.62142), 1e-3
#: Parameters of bump maps in v4 and v3.
BUMPS = ("displacement", "bumpmap")


class MaterialReader:
    """Reader for the materials of one scene; shapes that refer to one material share it.

    types: the conversions by pbrt's names; unknown: replaces others if the notes allow stand-ins.
    """

    def __init__(
        self,
        description: Description,
        textures: TextureReader,
        notes: Notes,
        types: Mapping[str, Convert],
        unknown: Convert,
    ) -> None:
        self.description = description
        self.textures = textures
        self.notes = notes
        self.types = types
        self._unknown = unknown
        self._made: dict[Entity, Material | None] = {}
        self._mixing: list[Entity] = []

    def material(self, entity: Entity) -> Material | None:
        """Return a material; None for one that light passes as if there was no surface."""
        if entity in self._mixing:
            raise SceneError(f"{entity.at}: mixes itself; name other materials")
        if entity not in self._made:
            self._mixing.append(entity)
            try:
                self._made[entity] = self._dressed(self.types.get(entity.kind, self._unknown)(self, entity), entity)
            finally:
                self._mixing.pop()
        return self._made[entity]

    def _dressed(self, material: Material | None, entity: Entity) -> Material | None:
        """Return the material with its normal map."""
        for name in BUMPS:
            entity.ignore([name])
            if name in entity.parameters:
                what, remedy = f"{name}: bump maps are not supported", "bake it to a normal map"
                self.notes.instead(entity, what, remedy, "it is left out", "bump map")
        normals = self.textures.normals(entity, "normalmap")
        return material if material is None or normals is None else replace(material, normal_map=normals)

    def named(self, name: str, user: Entity) -> Material | None:
        """Return a named material that another one uses."""
        return self.material(self.description.material(name, user))

    def roughness(self, entity: Entity, default: float, prefix: str = "") -> float | Texture:
        """Return √alpha of a microfacet distribution, of an isotropic one of the same mean if it is anisotropic."""
        plain = f"{prefix}roughness"
        known = {*entity.parameters}
        names = [f"{prefix}{axis}roughness" for axis in "uv"]
        found = [self.textures.number(entity, each if each in known else plain, default) for each in names]
        entity.ignore([plain])
        if isinstance(found[0], Texture) or isinstance(found[1], Texture):
            first, second = (entity.parameters.get(each if each in known else plain) for each in names)
            same = first is second or first == second
        else:
            same = found[0] == found[1]
        if not same:
            what, remedy = "its roughness differs in u and v", "write one roughness"
            stand_in = "their geometric mean is used, or a texture"
            self.notes.instead(entity, what, remedy, stand_in, f"{entity.kind}, anisotropic")
        remaps = entity.boolean("remaproughness", True)

        def clrts(values: Doubles) -> Doubles:
            return np.sqrt(np.clip(self._alpha(values) if remaps else values, 0, 1))

        for each in found:
            if isinstance(each, Texture):
                return self.textures.images.baked(each, "number", clrts)
        one, other = (float(clrts(np.array(each)) ** 2) for each in found if not isinstance(each, Texture))
        alpha = sqrt(one * other)
        return 0.0 if alpha < SMOOTH else sqrt(alpha)

    def _alpha(self, roughness: Doubles) -> Doubles:
        """Return alpha of a roughness between 0 and 1."""
        if self.description.old:
            return np.asarray(np.polyval(REMAP, np.log(np.maximum(roughness, LEAST))))
        return np.sqrt(np.maximum(roughness, 0))


Convert = Callable[[MaterialReader, Entity], Material | None]
