"""Conversion of Mitsuba's textures: bitmaps, checkerboards, and mesh attributes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import atan2, degrees, hypot
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from ...errors import SceneError
from ...scene.materials.textures import Picture, Texture, Wrap
from ..images.image_reader import linear_from_srgb, read_texels, srgb_from_linear
from .notes import Notes
from .values import Doubles, rgb
from .xml import Plugin

WRAPS: dict[str, Wrap] = {"repeat": "repeat", "mirror": "mirror", "clamp": "clamp"}
#: Mitsuba 0.x's filters of several texels per pixel, too; here there are several samples per pixel.
FILTERS: dict[str, Literal["linear", "nearest"]] = {
    "bilinear": "linear",
    "nearest": "nearest",
    "trilinear": "linear",
    "ewa": "linear",
}
#: Maximum number of bytes of converted textures.
MOST_BAKED = 2**31
#: Gamma of Mitsuba 0.x that is taken for sRGB, as is −1.
SRGB = 2.2
#: Conversion of texels from or to sRGB.
Curve = Literal["", "decode", "encode"]
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

    def __init__(self, notes: Notes) -> None:
        self._notes = notes
        self._baked = 0
        self._pictures: dict[tuple[str, Curve, bool], Picture] = {}

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
        raw = self._is_raw(plugin)
        if use == "normal" and not raw:
            plugin.refuse("is not raw", "write raw = true, for a normal", "bitmap, raw = false, for a normal")
        plugin.used |= {"format", "accel", "max_anisotropy", "cache"}  # affect only how Mitsuba stores the texels
        path = plugin.value("filename", str, "")
        place = _placed(plugin, plugin.transform("to_uv"))
        both = plugin.value("wrap_mode", str, "repeat")
        wraps = [WRAPS.get(plugin.value(f"wrap_mode_{axis}", str, both)) for axis in "uv"]
        kind = FILTERS.get(plugin.value("filter_type", str, "bilinear"))
        if wraps[0] is None or wraps[1] is None or kind is None:
            plugin.refuse("its wrap_mode or filter_type is unknown", f"write {', '.join(WRAPS)}; {', '.join(FILTERS)}")
        curve: Curve = "" if use == "normal" else "" if raw == (use == "number") else "encode" if raw else "decode"
        picture = self._picture(path, curve, grey=use == "number")
        return Texture(picture=picture, wrap=(wraps[0], wraps[1]), filter=kind, **place)

    def _is_raw(self, plugin: Plugin) -> bool:
        """Return whether the values are linear, by `raw`, or by Mitsuba 0.x's `gamma`."""
        gamma = plugin.value("gamma", float, 1.0 if plugin.value("raw", bool, False) else SRGB)
        if gamma not in (1, SRGB, -1):
            self._notes.instead(plugin, f"gamma is {gamma:g}", "write 1 or leave it out", "sRGB is used", "gamma")
        return gamma == 1

    def _picture(self, file: str, curve: Curve, *, grey: bool) -> Picture:
        """Read a file's texels of 8 bits, decoded from sRGB or encoded; grey: their luminance in all channels."""
        if (file, curve, grey) not in self._pictures:
            path = Path(file)
            texels = read_texels(path)
            values = np.asarray(texels[..., :3] / 255, np.float32)
            if curve:
                values = linear_from_srgb(values) if curve == "decode" else srgb_from_linear(values)
            if grey:
                values = np.repeat((values @ LUMINANCE.astype(np.float32))[..., None], 3, axis=2)
            if curve or grey:
                texels = np.concatenate([np.round(values * 255).astype(np.uint8), texels[..., 3:]], axis=2)
            self._pictures[file, curve, grey] = Picture(texels, path.stem)
        return self._pictures[file, curve, grey]

    def baked(
        self, texture: Texture, use: Literal["color", "number"], function: Callable[[Doubles], Doubles]
    ) -> Texture:
        """Return the texture with a function applied to its values, to 8 bits."""
        values = np.arange(256, dtype=np.float32) / np.float32(255)
        levels = linear_from_srgb(values) if use == "color" else values
        factors = np.broadcast_to(texture.factor, 3)
        table = function(np.clip(levels[:, None] * factors, 0, 1).astype(np.float64)).astype(np.float32)
        table = np.round((srgb_from_linear(table) if use == "color" else table) * 255).astype(np.uint8)
        self._baked += texture.picture.texels.nbytes
        if self._baked > MOST_BAKED:
            raise SceneError(f"scene: more than {MOST_BAKED >> 30} GiB of textures are converted; use smaller images")
        texels = texture.picture.texels.copy()
        for channel in range(3):
            texels[..., channel] = table[texels[..., channel], channel]
        return replace(texture, picture=Picture(texels, texture.picture.name), factor=1.0)

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


def mean_of(number: float | Texture) -> float:
    """Return a number, or the mean of a texture that stands for one."""
    if not isinstance(number, Texture):
        return number
    factor = number.factor if isinstance(number.factor, float) else 1.0
    return float(number.picture.texels[..., 0].mean()) / 255 * factor


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
