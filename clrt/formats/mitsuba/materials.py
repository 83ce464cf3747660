"""Reader for Mitsuba's BSDFs, whose conversions are in bsdf_types.py."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from ...errors import SceneError
from ...scene.materials.material_types import Material
from ...scene.materials.textures import Texture
from ..scene_parts.notes import Notes
from .bumps import Bump
from .textures import Attribute, TextureReader
from .xml import Plugin

WHITE = (1.0, 1.0, 1.0)


class ShapeMaterial(NamedTuple):
    """A material; the mesh attribute that multiplies its color, and the bump map of its surface, if any."""

    material: Material
    attribute: Attribute | None = None
    bump: Bump | None = None


class MaterialReader:
    """Reader for the BSDFs of one scene; shapes that refer to one BSDF share its material.

    types: the conversions by Mitsuba's names; unknown: replaces others if the notes allow stand-ins.
    """

    def __init__(self, textures: TextureReader, notes: Notes, types: Mapping[str, Convert], unknown: Convert) -> None:
        self.textures = textures
        self.notes = notes
        self.types = types
        self._unknown = unknown
        self._looks: dict[Plugin, ShapeMaterial] = {}

    def look(self, plugin: Plugin) -> ShapeMaterial:
        """Return the material of a <bsdf>."""
        if plugin not in self._looks:
            self._looks[plugin] = self.types.get(plugin.kind, self._unknown)(self, plugin)
        return self._looks[plugin]

    def only(self, plugin: Plugin) -> ShapeMaterial:
        """Return the material of the one BSDF nested in a BSDF."""
        nested = plugin.all("bsdf")
        if len(nested) != 1:
            raise SceneError(f"{plugin.at}: contains {len(nested)} BSDFs; write one")
        return self.look(nested[0])

    def color(self, plugin: Plugin, name: str, default: float) -> Any:
        """Return a color or a texture. Raises UnsupportedError for a mesh attribute."""
        color = self.textures.color(plugin, name, default)
        if isinstance(color, Attribute):
            plugin.refuse(f"{name} is an attribute", "write a color or a bitmap", f"{name} by a mesh's attribute")
        return color

    def number(self, plugin: Plugin, name: str, default: float) -> float | Texture:
        """Return a number or a texture. Raises UnsupportedError for a mesh attribute."""
        number = self.textures.number(plugin, name, default)
        if isinstance(number, Attribute):
            plugin.refuse(f"{name} is an attribute", "write a number or a bitmap", f"{name} by a mesh's attribute")
        assert isinstance(number, float | Texture)
        return number


Convert = Callable[[MaterialReader, Plugin], ShapeMaterial]
