"""Conversion of Mitsuba's textures: bitmaps, checkerboards, and mesh attributes."""

from __future__ import annotations

from math import atan2, degrees, hypot
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from ...scene.materials.textures import Picture, Texture, Wrap
from ..images.image_reader import linear_from_srgb, read_texels
from .values import Doubles, rgb
from .xml import Plugin

WRAPS: dict[str, Wrap] = {"repeat": "repeat", "mirror": "mirror", "clamp": "clamp"}
FILTERS: dict[str, Literal["linear", "nearest"]] = {"bilinear": "linear", "nearest": "nearest"}
#: Luminance weights of Rec. 709.
LUMINANCE = np.array([0.212671, 0.715160, 0.072169])
#: Tolerance for the columns of a texture's transform to be orthogonal, as the cosine of their angle.
SHEAR = 1e-6


class Attribute(NamedTuple):
    """Per-vertex or per-face colors of a mesh attribute, such as "vertex_color": low + value·(high − low)."""

    name: str
    low: tuple[float, float, float] = (0.0, 0.0, 0.0)
    high: tuple[float, float, float] = (1.0, 1.0, 1.0)


class TextureReader:
    """Reader for the textures of one scene; an image that several textures use is read once."""

    def __init__(self) -> None:
        self._pictures: dict[tuple[str, str], Picture] = {}

    def color(self, owner: Plugin, name: str, default: float, *, emitted: bool = False) -> Any:
        """Read a color: three numbers, a Texture or an Attribute."""
        child = owner.child(name)
        if child is None:
            return rgb(owner.color(name, default), emitted=emitted, bounded=not emitted)
        if child.kind == "checkerboard":
            return self._checkerboard(child, encoded=True)
        if child.kind == "mesh_attribute":
            return Attribute(child.value("name", str, ""))
        return self._bitmap(child, "color")

    def number(self, owner: Plugin, name: str, default: float) -> Any:
        """Read a number, a Texture or an Attribute."""
        child = owner.child(name)
        if child is None:
            value = owner.color(name, default)
            return value if isinstance(value, float) else float(LUMINANCE @ rgb(value, bounded=True))
        if child.kind == "checkerboard":
            return self._checkerboard(child, encoded=False)
        if child.kind == "mesh_attribute":
            return Attribute(child.value("name", str, ""))
        return self._bitmap(child, "number")

    def normals(self, owner: Plugin, name: str) -> Texture:
        """Read a normal map."""
        child = owner.child(name)
        if child is None:
            owner.refuse(f'has no texture "{name}"', "add one")
        if child.kind == "rawconstant":
            x, y, z = child.point("value") or (0.5, 0.5, 1.0)
            texels = np.full((1, 1, 4), 255, np.uint8)
            texels[..., :3] = np.round(np.array([x, y, z]) * 255)
            return Texture(picture=Picture(texels, "normal"))
        return self._bitmap(child, "normal")

    def _bitmap(self, plugin: Plugin, use: Literal["color", "number", "normal"]) -> Texture:
        if plugin.kind != "bitmap":
            plugin.refuse_kind("bitmap, checkerboard or mesh_attribute")
        raw = plugin.value("raw", bool, False)
        if raw != (use == "normal") and use != "number":
            plugin.refuse(
                f"is {'raw' if raw else 'not raw'}",
                f"write raw = {str(not raw).lower()}, for a {use}",
                f"bitmap, raw = {str(raw).lower()}, for a {use}",
            )
        plugin.used |= {"format", "accel"}  # these affect only how Mitsuba stores the texels
        path = plugin.value("filename", str, "")
        place = _placed(plugin, plugin.transform("to_uv"))
        wrap = WRAPS.get(plugin.value("wrap_mode", str, "repeat"))
        kind = FILTERS.get(plugin.value("filter_type", str, "bilinear"))
        if wrap is None or kind is None:
            plugin.refuse("its wrap_mode or filter_type is unknown", f"write {', '.join(WRAPS)}; {', '.join(FILTERS)}")
        linear = "linear" if use == "number" and not raw else ""
        return Texture(picture=self._picture(path, linear), wrap=(wrap, wrap), filter=kind, **place)

    def _picture(self, file: str, curve: str) -> Picture:
        """Read a file's texels: unchanged, or as linear luminance of 8 bits in all channels."""
        if (file, curve) not in self._pictures:
            path = Path(file)
            texels = read_texels(path)
            if curve:
                linear = linear_from_srgb(np.asarray(texels[..., :3] / 255, np.float32)) @ LUMINANCE
                texels = np.repeat(np.round(linear * 255).astype(np.uint8)[..., None], 4, axis=2)
            self._pictures[file, curve] = Picture(texels, path.stem)
        return self._pictures[file, curve]

    def _checkerboard(self, plugin: Plugin, *, encoded: bool) -> Texture:
        """Return 2x2 texels, with factors that make the brighter color exact and the other as close as 8 bits allow."""
        first, second = (
            rgb(plugin.color(name, value), bounded=True) for name, value in (("color0", 0.4), ("color1", 0.2))
        )
        if not encoded:  # Mitsuba 3 swaps the two for numbers
            first, second = second, first
        texels = np.full((2, 2, 4), 255, np.uint8)
        factors = [0.0, 0.0, 0.0]
        for channel in range(3):
            one, other, factors[channel] = _pair(first[channel], second[channel], encoded)
            texels[..., channel] = [[one, other], [other, one]]
        place = _placed(plugin, plugin.transform("to_uv"))
        factor = (factors[0], factors[1], factors[2]) if encoded else factors[0]
        return Texture(picture=Picture(texels, "checkerboard"), factor=factor, filter="nearest", **place)


def _pair(first: float, second: float, encoded: bool) -> tuple[int, int, float]:
    """Return the two texels, and the factor of at most 1, that approximate two values best."""
    levels = np.arange(256) / 255
    levels = linear_from_srgb(levels.astype(np.float32)).astype(np.float64) if encoded else levels
    most, least = max(first, second), min(first, second)
    if most == 0:
        return 0, 0, 1.0
    bright = np.flatnonzero(levels >= most)
    ratio = levels[:, None] / levels[bright]
    low, place = np.unravel_index(int(np.argmin(np.abs(ratio - least / most))), ratio.shape)
    texels = int(bright[place]), int(low)
    one, other = texels if first >= second else texels[::-1]
    return one, other, most / float(levels[texels[0]])


def _placed(plugin: Plugin, to_uv: Doubles) -> dict[str, Any]:
    """Return offset, scale and rotation_degrees of a texture with the transform `to_uv`."""
    matrix = to_uv[:2, :2]
    columns = hypot(*matrix[:, 0]), hypot(*matrix[:, 1])
    if abs(float(matrix[:, 0] @ matrix[:, 1])) > SHEAR * columns[0] * columns[1]:
        plugin.refuse("its to_uv shears", "only rotate, scale and translate", "to_uv that shears")
    angle = atan2(-matrix[1, 0], matrix[0, 0])
    height = float(np.linalg.det(matrix)) / columns[0] if columns[0] else columns[1]
    return {
        "offset": (float(to_uv[0, 3]), float(to_uv[1, 3])),
        "scale": (columns[0], height),
        "rotation_degrees": degrees(angle),
    }
