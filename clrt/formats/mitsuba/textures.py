"""Conversion of Mitsuba's textures: bitmaps, checkerboards, and mesh attributes."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import replace
from math import atan2, degrees, hypot
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from ...errors import SceneError
from ...scene.light_images import LightImage
from ...scene.materials.textures import Picture, Texture, Wrap
from ..images.image_reader import read_picture, srgb_from_linear
from ..scene_parts.notes import Notes
from ..scene_parts.texture_images import FLOATS, LUMINANCE, Curve, TextureImages, checks
from .bumps import Bump, Sizes, finer, normal_map
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
#: Parameters that affect only how Mitsuba stores the texels.
STORED = {"format", "accel", "max_anisotropy", "cache"}
#: Gamma of Mitsuba 0.x that is taken for sRGB, as is −1.
SRGB = 2.2
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
        self._images = TextureImages()
        self.baked = self._images.baked
        self._normals: dict[Hashable, Texture] = {}

    def color(self, owner: Plugin, name: str, default: float, *, emitted: bool = False) -> Any:
        """Read a color: three numbers, a Texture or an Attribute."""
        child = owner.child(name)
        if child is None:
            value = rgb(owner.color(name, default), emitted=emitted, bounded=not emitted)
            return value if emitted else self._reflectance(owner, name, value)
        if child.kind == "checkerboard":
            return self._checkerboard(child, encoded=True)
        if child.kind == "mesh_attribute":
            return Attribute(child.value("name", str, ""))
        if child.kind == "scale":
            return self._scaled(child, "color")
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
        if child.kind == "scale":
            return self._scaled(child, "number")
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

    def _reflectance(self, owner: Plugin, name: str, value: tuple[float, float, float]) -> tuple[float, float, float]:
        """Return a color of at most 1, as some files write 0 to 255."""
        if max(value) <= 1:
            return value
        what = f"{name} {max(value):g} is above 1"
        self._notes.instead(owner, what, "write fractions from 0 to 1", "1 is used", f"{name} above 1")
        red, green, blue = (min(part, 1.0) for part in value)
        return red, green, blue

    def _scaled(self, plugin: Plugin, use: Literal["color", "number"]) -> Texture:
        """Read Mitsuba 0.x's `scale`, a texture times a number or a color."""
        inner = plugin.all("texture")
        if len(inner) != 1:
            raise SceneError(f"{plugin.at}: contains {len(inner)} textures; write one")
        texture = self._bitmap(inner[0], use)
        by = rgb(plugin.color("scale", 1.0))
        red, green, blue = (factor * part for factor, part in zip(np.broadcast_to(texture.factor, 3).tolist(), by))
        return replace(texture, factor=(red, green, blue) if use == "color" else float(LUMINANCE @ (red, green, blue)))

    def heights(self, owner: Plugin) -> Texture:
        """Read the one texture of a plugin as numbers."""
        (plugin,) = owner.all("texture")
        return self._bitmap(plugin, "number")

    def _bitmap(self, plugin: Plugin, use: Literal["color", "number", "normal"]) -> Texture:
        if plugin.kind != "bitmap":
            plugin.refuse_kind("bitmap, checkerboard or mesh_attribute")
        raw = self._is_raw(plugin)
        if use == "normal" and not raw:
            plugin.refuse("is not raw", "write raw = true, for a normal", "bitmap, raw = false, for a normal")
        plugin.used |= STORED
        mapping = _mapping(plugin)
        curve: Curve = "" if use == "normal" else "" if raw == (use == "number") else "encode" if raw else "decode"
        picture = self._images.picture(plugin.value("filename", str, ""), curve, grey=use == "number")
        return Texture(picture=picture, **mapping)

    def light_image(self, owner: Plugin, name: str) -> LightImage | None:
        """Read the texture of a light; None if it has none."""
        plugin = owner.child(name)
        if plugin is None:
            return None
        if plugin.kind == "checkerboard":
            pair = [
                rgb(plugin.color(color, value), emitted=True) for color, value in (("color0", 0.4), ("color1", 0.2))
            ]
            pixels = np.array([pair, pair[::-1]], np.float32)
            mapping = {"filter": "nearest", "wrap": ("repeat", "repeat"), **_placed(plugin, plugin.transform("to_uv"))}
            return LightImage(pixels=pixels, name="checkerboard", **mapping)
        if plugin.kind != "bitmap":
            plugin.refuse_kind("bitmap or checkerboard")
        plugin.used |= STORED
        path = Path(plugin.value("filename", str, ""))
        pixels = read_picture(path)
        if self._is_raw(plugin) and path.suffix.lower() not in FLOATS:
            pixels = srgb_from_linear(pixels)
        for axis in (0, 1):
            if pixels.shape[axis] == 1:  # Mitsuba doubles such images, which affects a projector's aspect ratio
                pixels = np.repeat(pixels, 2, axis)
        return LightImage(pixels=pixels, name=path.stem, **_mapping(plugin))

    def _is_raw(self, plugin: Plugin) -> bool:
        """Return whether the values are linear, by `raw`, or by Mitsuba 0.x's `gamma`."""
        gamma = plugin.value("gamma", float, 1.0 if plugin.value("raw", bool, False) else SRGB)
        if gamma not in (1, SRGB, -1):
            self._notes.instead(plugin, f"gamma is {gamma:g}", "write 1 or leave it out", "sRGB is used", "gamma")
        return gamma == 1

    def bumped(self, bump: Bump, sizes: Sizes) -> Texture:
        """Return the normal map of a bump map on a surface where its image has these sizes; shared if they are even."""
        size = sizes.texels or sizes.median
        key = bump.heights.picture, bump.heights.factor, bump.heights.wrap, bump.scale, *map(float, sizes.median)
        if sizes.texels or key not in self._normals:
            self._images.count(finer(bump.heights) ** 2 * bump.heights.picture.texels.nbytes)
            made = normal_map(bump, size)
        else:
            made = self._normals[key]
        if sizes.texels is None:
            self._normals[key] = made
        return replace(bump.heights, picture=made.picture, factor=made.factor, filter="linear")

    def _checkerboard(self, plugin: Plugin, *, encoded: bool) -> Texture:
        """Return 2x2 texels, with factors that make the brighter color exact and the other as close as 8 bits allow."""
        first, second = (
            rgb(plugin.color(name, value), bounded=True) for name, value in (("color0", 0.4), ("color1", 0.2))
        )
        if not encoded:  # Mitsuba 3 swaps the two for numbers
            first, second = second, first
        picture, factor = checks(first, second, encoded=encoded)
        return Texture(picture=picture, factor=factor, filter="nearest", **_placed(plugin, plugin.transform("to_uv")))


def _mapping(plugin: Plugin) -> dict[str, Any]:
    """Return how a bitmap is placed, wrapped and filtered."""
    both = plugin.value("wrap_mode", str, "repeat")
    wraps = [WRAPS.get(plugin.value(f"wrap_mode_{axis}", str, both)) for axis in "uv"]
    kind = FILTERS.get(plugin.value("filter_type", str, "bilinear"))
    if wraps[0] is None or wraps[1] is None or kind is None:
        plugin.refuse("its wrap_mode or filter_type is unknown", f"write {', '.join(WRAPS)}; {', '.join(FILTERS)}")
    return {"wrap": (wraps[0], wraps[1]), "filter": kind, **_placed(plugin, plugin.transform("to_uv"))}


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
