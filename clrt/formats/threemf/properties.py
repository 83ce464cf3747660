"""Properties of 3MF triangles: materials, colors and texture coordinates of their corners, and layers of these."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from ...file_names import printable
from ...scene.materials.material_types import Diffuse, Material
from ...scene.materials.textures import Picture, Texture
from ..images.image_reader import linear_from_srgb, read_texels

log = logging.getLogger(__name__)
Array = NDArray[Any]
#: Stands for a texture that cannot be read.
GREY = Picture(np.full((1, 1, 4), [204, 204, 204, 255], np.uint8), "grey")


class Appearance(NamedTuple):
    """Appearance of triangles. colors: (3m, 4) uint8, encoded, and uv: (3m, 2) float32, v upwards, of their corners."""

    material: Material | None = None
    name: str = ""
    colors: Array | None = None
    uv: Array | None = None


class Properties:
    """Groups of properties of a file, as `package.decode` returns them."""

    def __init__(self, path: Path, arrays: dict[str, Array], facts: dict[str, Any]) -> None:
        self._path, self._arrays = path, arrays
        self._groups, self._textures = facts["groups"], facts["textures"]
        self._materials: dict[tuple[str, int], Diffuse] = {}
        #: Descriptions of what cannot be rendered.
        self.ignored: list[str] = []

    def appearances(self, used: Array) -> Iterator[tuple[Array, Appearance]]:
        """Yield triangles, (k,) indices, and their appearance. used: (m, 4), a group and a property per corner."""
        for group in np.unique(used[:, 0]).tolist():
            rows = np.flatnonzero(used[:, 0] == group)
            corners = np.where(used[rows, 1:] == 0, used[rows, 1:2], used[rows, 1:])
            facts = self._groups.get(str(group))
            if facts is None:
                yield rows, Appearance()
            elif facts["kind"] == "material":  # a triangle has only one
                for entry in np.unique(corners[:, 0]).tolist():
                    yield rows[corners[:, 0] == entry], self._material(group, entry)
            else:
                yield rows, self._appearance(group, corners.ravel())

    def _appearance(self, group: int, entries: Array) -> Appearance:
        """Return the appearance of corners with properties of a group of colors, texture coordinates or layers."""
        facts = self._groups[str(group)]
        if facts["kind"] == "texture":
            return self._textured(facts["texture"], self._looked_up(group, entries))
        if facts["kind"] == "multi":
            return self._layered(facts["layers"], self._looked_up(group, entries).astype(np.int64))
        return Appearance(colors=np.rint(self._looked_up(group, entries)).astype(np.uint8))

    def _looked_up(self, group: int, entries: Array) -> Array:
        """Return the values of properties, (c, k)."""
        table = self._arrays[f"group {group}"]
        if not len(table):
            raise SceneError(f"its group of properties {group} is empty; export it again")
        order = np.argsort(table[:, 0])
        places = np.searchsorted(table[order, 0], entries).clip(0, len(table) - 1)
        return np.asarray(table[order[places], 1:])

    def _material(self, group: int, entry: int) -> Appearance:
        """Return the appearance of a base material."""
        name = printable(self._groups[str(group)]["names"].get(str(entry), ""))
        if (key := (str(group), entry)) not in self._materials:
            encoded = (self._looked_up(group, np.array([entry]))[0] / 255).astype(np.float32)
            red, green, blue = linear_from_srgb(encoded[:3]).tolist()
            self._materials[key] = Diffuse(color=(red, green, blue), opacity=float(encoded[3]))
        return Appearance(self._materials[key], name)

    def _textured(self, number: int, uv: Array, colors: Array | None = None) -> Appearance:
        """Return the appearance of a texture, times the colors if there are any."""
        key = "texture", number
        if key not in self._materials:
            stored = self._textures[number]
            texture = Texture(picture=self._picture(number), wrap=tuple(stored["wrap"]), filter=stored["filter"])
            opaque = bool((texture.picture.texels[..., 3] == 255).all())
            opacity = 1.0 if opaque else Texture(picture=texture.picture, channel="alpha", wrap=texture.wrap)
            self._materials[key] = Diffuse(color=texture, opacity=opacity)
        return Appearance(self._materials[key], colors=colors, uv=uv.astype(np.float32))

    def _picture(self, number: int) -> Picture:
        name = printable(self._textures[number]["name"])
        try:
            return Picture(read_texels(self._arrays[f"texture {number}"].tobytes(), name), name)
        except SceneError as error:
            log.warning("%s: a texture is ignored: %s", self._path, error)
            return GREY

    def _layered(self, layers: list[tuple[int, bool]], entries: Array) -> Appearance:
        """Return the appearance of layers from the lowest to the highest; a texture hides what it is mixed with."""
        color: Array | None = None
        texture: tuple[int, Array] | None = None
        for (group, multiplies), column in zip(layers, entries.T):
            facts = self._groups.get(str(group))
            if (
                facts is None
                or facts["kind"] == "multi"
                or (texture and (facts["kind"] == "texture" or not multiplies))
            ):
                self._ignore("layers above a texture")
            elif facts["kind"] == "texture":
                texture = facts["texture"], self._looked_up(group, column)
                color = color if multiplies else None
            else:
                color = _blended(color, self._looked_up(group, column), multiplies)
        colors = None if color is None else np.rint(color).astype(np.uint8)
        return Appearance(colors=colors) if texture is None else self._textured(*texture, colors)

    def _ignore(self, what: str) -> None:
        if what not in self.ignored:
            self.ignored.append(what)


def _blended(below: Array | None, above: Array, multiplies: bool) -> Array:
    """Return encoded colors (c, 4), up to 255, of a layer on another one (materials extension, 5.1)."""
    if below is None:
        return above
    if multiplies:
        return below * above / 255
    share = above[:, 3:] / 255
    mixed = above[:, :3] * share + below[:, :3] * (1 - share)
    return np.column_stack([mixed, 255 - (255 - above[:, 3]) * (255 - below[:, 3]) / 255])
