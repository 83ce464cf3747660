"""Conversion of pbrt's textures: images, checkerboards, and mixtures of these and of colors."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ...errors import SceneError
from ...scene.materials.textures import Texture, Wrap
from ..scene_parts.notes import Notes
from ..scene_parts.texture_images import FLOATS, LUMINANCE, Curve, TextureImages, checks
from .entities import Entity
from .named_spectra import Triple
from .spectra import Spectra
from .tokens import Doubles

Use = Literal["color", "number"]
#: Three numbers or a texture of a color; a number or a texture of one.
Value = Any
WRAPS: dict[str, Wrap] = {"repeat": "repeat", "clamp": "clamp"}
#: Maximum number of textures that contain each other.
DEEPEST = 32
#: What stands for textures that clrt lacks: a number, or that parameter.
STAND_INS = {"dots": "outside", "directionmix": "tex1", "bilerp": "v00"}
#: Parameters of images that affect how pbrt filters them.
FILTERING = ("maxanisotropy", "filter", "trilinear", "aamode")
#: Default of `gamma` in v3, by suffix.
ENCODED = (".tga", ".png")


class TextureReader:
    """Reader for the textures of one scene."""

    def __init__(self, spectra: Spectra, notes: Notes, old: bool) -> None:
        self.images = TextureImages()
        self.spectra = spectra
        self._notes = notes
        self._old = old

    def color(self, entity: Entity, name: str, default: float) -> Value:
        """Return a reflectance: three numbers from 0 to 1, or a texture."""
        if entity.is_textured(name):
            return self._value(entity.texture(name, "spectrum"), "color", 0)
        return self.spectra.reflectance(entity, name, default)

    def number(self, entity: Entity, name: str, default: float) -> float | Texture:
        """Return a number or a texture of one."""
        if entity.is_textured(name):
            found = self._value(entity.texture(name, "float"), "number", 0)
            assert isinstance(found, float | Texture)
            return found
        return entity.number(name, default)

    def normals(self, entity: Entity, name: str) -> Texture | None:
        """Return the normal map that a parameter names the file of."""
        path = entity.path(name)
        if not path:
            return None
        linear = Path(path).suffix.lower() in FLOATS
        picture = self.images.linear_picture(path, "number") if linear else self.images.picture(path, "", grey=False)
        return Texture(picture=picture, scale=(1.0, -1.0), offset=(0.0, 1.0))

    def _value(self, texture: Entity, use: Use, depth: int) -> Value:
        if depth > DEEPEST:
            raise SceneError(f"{texture.at}: textures contain each other more than {DEEPEST} deep; remove some")
        texture.used.add("mapping")
        if texture.kind == "constant":
            return self._own(texture, "value", 1.0, use, depth)
        if texture.kind == "imagemap":
            return self._image(texture, use)
        if texture.kind == "checkerboard":
            return self._checkerboard(texture, use, depth)
        if texture.kind == "scale":
            return self._scale(texture, use, depth)
        if texture.kind == "mix":
            return self._mix(texture, use, depth)
        return self._stand_in(texture, use, depth)

    def _own(self, texture: Entity, name: str, default: float, use: Use, depth: int) -> Value:
        """Return a parameter of a texture: a color or a number, or a texture."""
        if texture.is_textured(name):
            return self._value(texture.texture(name, "spectrum" if use == "color" else "float"), use, depth + 1)
        if use == "color":
            return self.spectra.unbounded(texture, name, default)
        if name in texture.parameters and texture.parameters[name].type not in ("float", "integer"):
            return float(LUMINANCE @ self.spectra.unbounded(texture, name, default))
        return texture.number(name, default)

    def _stand_in(self, texture: Entity, use: Use, depth: int) -> Value:
        name = STAND_INS.get(texture.kind, "")
        what = f'texture type "{texture.kind}" is not supported'
        remedy = "use constant, imagemap, checkerboard, scale or mix"
        self._notes.instead(texture, what, remedy, f'its "{name}" is used' if name else "0.5 is used")
        texture.ignore()
        return self._own(texture, name, 0.5, use, depth) if name else 0.5 if use == "number" else (0.5, 0.5, 0.5)

    def _image(self, texture: Entity, use: Use) -> Value:
        texture.ignore((*FILTERING, "gamma", "encoding"))
        path, nearest = texture.path("filename"), texture.string("filter", "bilinear") == "point"
        wrap = texture.string("wrap", "repeat")
        if wrap not in WRAPS:
            self._notes.instead(texture, f'wrap "{wrap}" is not supported', "write repeat or clamp", "clamp is used")
        if Path(path).suffix.lower() in FLOATS:
            picture = self.images.linear_picture(path, use)
        else:
            is_linear = self._is_linear(texture, path)
            curve: Curve = "encode" if use == "color" and is_linear else ""
            curve = "decode" if use == "number" and not is_linear else curve
            picture = self.images.picture(path, curve, grey=self._old and use == "number")
        image = Texture(
            picture=picture,
            wrap=(WRAPS.get(wrap, "clamp"),) * 2,
            filter="nearest" if nearest else "linear",
            **self._placed(texture),
        )
        scale = texture.number("scale", 1.0)
        if texture.boolean("invert", False):
            return self.images.baked(image, use, lambda values: np.clip(1 - scale * values, 0, 1))
        return replace(image, factor=max(scale, 0.0))

    def _is_linear(self, texture: Entity, path: str) -> bool:
        """Return whether the values of an image of integers are linear."""
        suffix = Path(path).suffix.lower()
        if self._old:
            return not texture.boolean("gamma", suffix in ENCODED)
        encoding = texture.string("encoding", "sRGB").lower()
        if encoding not in ("srgb", "linear"):
            self._notes.differ(texture, f'sRGB instead of the encoding "{encoding}"')
        return encoding == "linear" and suffix == ".png"  # pbrt decodes others from sRGB anyway

    def _placed(self, texture: Entity, period: float = 1.0) -> dict[str, Any]:
        """Return offset and scale of a texture whose image repeats after `period`; v points up in pbrt."""
        mapping = texture.string("mapping", "uv")
        if mapping != "uv":
            texture.ignore(("v1", "v2"))
            what = f'mapping "{mapping}" is not supported'
            self._notes.instead(texture, what, "use uv", "uv is used", f"texture mapping {mapping}")
        su, sv = (texture.number(f"{axis}scale", 1.0) / period for axis in "uv")
        du, dv = (texture.number(f"{axis}delta", 0.0) / period for axis in "uv")
        return {"scale": (su, -sv), "offset": (du, 1 - dv)}

    def _checkerboard(self, texture: Entity, use: Use, depth: int) -> Value:
        texture.ignore(FILTERING)
        first, second = (self._own(texture, f"tex{i}", 2.0 - i, use, depth) for i in (1, 2))
        if texture.integer("dimension", 2) != 2 or isinstance(first, Texture) or isinstance(second, Texture):
            texture.ignore()
            what = "is three-dimensional, or consists of images"
            remedy = "write two colors and dimension 2"
            self._notes.instead(texture, what, remedy, "its first color is used", "checkerboard of images or in 3D")
            return first
        one, other = (np.clip(np.broadcast_to(each, 3), 0, 1).tolist() for each in (first, second))
        # The upper left check has an even column and an odd row.
        picture, factor = checks(tuple(other), tuple(one), encoded=use == "color")
        return Texture(picture=picture, factor=factor, filter="nearest", **self._placed(texture, period=2.0))

    def _scale(self, texture: Entity, use: Use, depth: int) -> Value:
        names = ("tex", "scale") if {"tex", "scale"} & texture.parameters.keys() else ("tex1", "tex2")
        first = self._own(texture, names[0], 1.0, use, depth)
        if use == "color" and names[1] == "scale" and texture.is_textured("scale"):
            second = self._value(texture.texture("scale", "float"), "number", depth + 1)
        else:
            second = self._own(texture, names[1], 1.0, use, depth)
        if isinstance(first, Texture) and isinstance(second, Texture):
            what = "multiplies two images"
            self._notes.instead(texture, what, "multiply them beforehand", "the first is used", "product of images")
            return first
        if isinstance(second, Texture):
            first, second = second, first
        if isinstance(first, Texture):
            return replace(first, factor=_scaled(first.factor, second))
        product = np.multiply(first, second)
        return float(product) if use == "number" else tuple(np.broadcast_to(product, 3).tolist())

    def _mix(self, texture: Entity, use: Use, depth: int) -> Value:
        first, second = (self._own(texture, f"tex{i}", i - 1.0, use, depth) for i in (1, 2))
        amount = self._own(texture, "amount", 0.5, "number", depth)
        images = [isinstance(each, Texture) for each in (first, second)]
        if isinstance(amount, Texture) and not any(images):
            one, other = (np.broadcast_to(each, 3).tolist() for each in (first, second))
            return self.images.blended(amount, tuple(one), tuple(other), use)
        if isinstance(amount, float) and sum(images) == 1:
            image, color, share = (first, second, 1 - amount) if images[0] else (second, first, amount)

            def mixed(values: Doubles) -> Doubles:
                return np.asarray(share * values + (1 - share) * np.asarray(color))

            return self.images.baked(image, use, mixed)
        if isinstance(amount, float) and (not any(images) or amount in (0.0, 1.0)):
            if amount in (0.0, 1.0):
                return (first, second)[int(amount)]
            value = (1 - amount) * np.asarray(first) + amount * np.asarray(second)
            return float(value) if use == "number" else tuple(value.tolist())
        what = "mixes several images"
        self._notes.instead(texture, what, "mix them beforehand", "the first is used", "mixture of images")
        return second if isinstance(amount, float) and amount > 0.5 else first


def _scaled(factor: float | Triple, other: float | Triple) -> float | Triple:
    product = np.multiply(factor, other)
    if product.ndim == 0:
        return float(product)
    red, green, blue = product.tolist()
    return red, green, blue
