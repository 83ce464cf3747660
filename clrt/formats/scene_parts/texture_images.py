"""Texels of textures, converted where a renderer stores them differently: the curves of sRGB, luminances, checks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from ...scene.materials.textures import Picture, Texture
from ..images.image_reader import linear_from_srgb, read_picture, read_texels, srgb_from_linear

Doubles = NDArray[np.float64]
#: Maximum number of bytes of converted textures.
MOST_BAKED = 2**31
#: Suffixes of images of floats, which are linear.
FLOATS = (".exr", ".hdr", ".pfm")
Triple = tuple[float, float, float]
#: Conversion of texels from or to sRGB.
Curve = Literal["", "decode", "encode"]
#: Luminance weights of Rec. 709.
LUMINANCE = np.array([0.212671, 0.715160, 0.072169])


class TextureImages:
    """Images of the textures of one scene; one that several textures use is read once."""

    def __init__(self) -> None:
        self._baked = 0
        self._pictures: dict[tuple[str, Curve, bool], Picture] = {}

    def picture(self, file: str, curve: Curve, *, grey: bool) -> Picture:
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

    def linear_picture(self, file: str, use: Literal["color", "number"]) -> Picture:
        """Read an image of floats, which are linear, as texels of 8 bits; what is outside 0 to 1 is clamped."""
        curve: Curve = "encode" if use == "color" else "decode"
        if (file, curve, False) not in self._pictures:
            pixels = np.nan_to_num(read_picture(file)).clip(0, 1)
            texels = np.full((*pixels.shape[:2], 4), 255, np.uint8)
            texels[..., :3] = np.round((srgb_from_linear(pixels) if use == "color" else pixels) * 255)
            self._pictures[file, curve, False] = Picture(texels, Path(file).stem)
        return self._pictures[file, curve, False]

    def baked(
        self, texture: Texture, use: Literal["color", "number"], function: Callable[[Doubles], Doubles]
    ) -> Texture:
        """Return the texture with a function applied to its values, to 8 bits."""
        values = np.arange(256, dtype=np.float32) / np.float32(255)
        levels = linear_from_srgb(values) if use == "color" else values
        factors = np.broadcast_to(texture.factor, 3)
        table = function(np.clip(levels[:, None] * factors, 0, 1).astype(np.float64)).astype(np.float32)
        table = np.round((srgb_from_linear(table) if use == "color" else table) * 255).astype(np.uint8)
        self.count(texture.picture.texels.nbytes)
        texels = texture.picture.texels.copy()
        for channel in range(3):
            texels[..., channel] = table[texels[..., channel], channel]
        return replace(texture, picture=Picture(texels, texture.picture.name), factor=1.0)

    def blended(self, amount: Texture, first: Triple, second: Triple, use: Literal["color", "number"]) -> Texture:
        """Return the texture of two colors, or of two numbers three times, mixed by a texture of numbers."""
        factor = amount.factor if isinstance(amount.factor, float) else 1.0
        share = np.clip(np.arange(256) / 255 * factor, 0, 1)[:, None]
        table = np.clip((1 - share) * np.array(first) + share * np.array(second), 0, 1).astype(np.float32)
        table = np.round((srgb_from_linear(table) if use == "color" else table) * 255).astype(np.uint8)
        texels = np.full_like(amount.picture.texels, 255)
        texels[..., :3] = table[amount.picture.texels[..., 0]]
        self.count(texels.nbytes)
        return replace(amount, picture=Picture(texels, amount.picture.name), factor=1.0)

    def count(self, size: int) -> None:
        """Count the bytes of a converted texture. Raises SceneError if they are too many in all."""
        self._baked += size
        if self._baked > MOST_BAKED:
            raise SceneError(f"scene: more than {MOST_BAKED >> 30} GiB of textures are converted; use smaller images")


def mean_of(number: float | Texture) -> float:
    """Return a number, or the mean of a texture that stands for one."""
    if not isinstance(number, Texture):
        return number
    factor = number.factor if isinstance(number.factor, float) else 1.0
    return float(number.picture.texels[..., 0].mean()) / 255 * factor


def checks(
    first: tuple[float, float, float], second: tuple[float, float, float], *, encoded: bool
) -> tuple[Picture, float | tuple[float, float, float]]:
    """Return 2x2 texels of two colors, or numbers unless `encoded`, and a factor that makes the brighter one exact and
    the other as close as 8 bits allow. The first is in the upper left corner."""
    texels = np.full((2, 2, 4), 255, np.uint8)
    factors = [0.0, 0.0, 0.0]
    for channel in range(3):
        one, other, factors[channel] = pair_of_texels(first[channel], second[channel], encoded)
        texels[..., channel] = [[one, other], [other, one]]
    factor = (factors[0], factors[1], factors[2]) if encoded else factors[0]
    return Picture(texels, "checkerboard"), factor


def pair_of_texels(first: float, second: float, encoded: bool) -> tuple[int, int, float]:
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
