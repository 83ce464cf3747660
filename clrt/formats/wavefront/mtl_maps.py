"""Textures of Wavefront MTL libraries: `map_Kd -s 2 2 1 wood.png` and the like."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from ...errors import SceneError
from ...file_names import printable
from ...scene.materials.textures import Channel, Picture, Texture, Wrap
from ..images.image_reader import read_texels
from ..referenced_files import find_file

log = logging.getLogger(__name__)

#: Maximum number of arguments of an option; trailing ones may be omitted.
OPTIONS = {
    "-blendu": 1,
    "-blendv": 1,
    "-bm": 1,
    "-boost": 1,
    "-cc": 1,
    "-clamp": 1,
    "-imfchan": 1,
    "-mm": 2,
    "-o": 3,
    "-s": 3,
    "-t": 3,
    "-texres": 1,
    "-type": 1,
}
CHANNELS: dict[str, Channel] = {"r": "red", "g": "green", "b": "blue", "m": "alpha"}
#: Weights of red, green and blue (Rec. 709).
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
#: By how much the mean blue of a normal map exceeds red and green, of 255; it is about 128.
NORMAL_BLUE = 40
#: What a map is for.
Kind = Literal["color", "number", "opacity"]


class TextureMap(NamedTuple):
    """A map's file name, and the arguments of its options."""

    file: str
    options: dict[str, list[str]]


def parse_map(words: str) -> TextureMap:
    """Parse a map statement: options first; the rest is the file name, which may be quoted and contain spaces."""
    rest, options = words.strip(), {}
    while (option := rest.split(None, 1)[:1]) and option[0].lower() in OPTIONS:
        given = rest.split()
        count = 1
        while count < OPTIONS[option[0].lower()] and len(given) > count + 2 and _is_number(given[count + 1]):
            count += 1
        options[option[0].lower()] = given[1 : count + 1]
        rest = (rest.split(None, count + 1) + [""] * (count + 2))[count + 1]
    return TextureMap(rest.strip('"'), options)


class Maps:
    """Reader for the maps of a library, each image once; they are in its folder, or in that of the model."""

    def __init__(self, model: Path, folder: Path | None = None) -> None:
        self._model, self._folders = model, [folder or model.parent, model.parent]
        self._pictures: dict[str, Picture | None] = {}
        self._luminances: dict[str, Picture] = {}
        #: Keys of the maps of heights, which are not supported.
        self.ignored: set[str] = set()

    def texture(self, words: str, kind: Kind = "color") -> Texture | None:
        """Return the texture; None, with a warning, if its image cannot be read. In OBJ files v points up.

        A number is the luminance unless the option -imfchan names a channel; an opacity is the image's, if it has one.
        """
        name, options = parse_map(words)
        picture = self._picture(name)
        if picture is None:
            return None
        channel = CHANNELS.get(options.get("-imfchan", [""])[0].lower())
        if channel is None and kind == "opacity" and "-imfchan" not in options and (picture.texels[..., 3] < 255).any():
            channel = "alpha"
        if channel is None and kind != "color":
            picture = self._luminance(name, picture)
        scale_u, scale_v = _pair(options.get("-s"), 1.0)
        offset_u, offset_v = _pair(options.get("-o"), 0.0)
        wrap: Wrap = "clamp" if options.get("-clamp") == ["on"] else "repeat"
        return Texture(
            picture=picture,
            scale=(scale_u, scale_v),
            offset=(offset_u, 1 - scale_v - offset_v),
            channel=channel or "red",
            wrap=(wrap, wrap),
        )

    def bump(self, words: str) -> Texture | None:
        """Return the texture if its image has normals, which are mostly blue, instead of heights."""
        name = parse_map(words).file
        if find_file(self._model, self._folders, name) is None or (picture := self._picture(name)) is None:
            return None
        red, green, blue = picture.texels[..., :3].reshape(-1, 3).mean(axis=0)
        is_normal_map = blue > max(red, green) + NORMAL_BLUE
        return self.texture(words) if is_normal_map else None

    def _picture(self, name: str) -> Picture | None:
        if name not in self._pictures:
            try:
                file = find_file(self._model, self._folders, name)
                texels = read_texels(file or self._folders[0] / name.replace("\\", "/"))
                self._pictures[name] = Picture(texels, printable(name))
            except (SceneError, OSError, ValueError) as error:
                log.warning("%s: a texture is ignored: %s", self._model, error)
                self._pictures[name] = None
        return self._pictures[name]

    def _luminance(self, name: str, picture: Picture) -> Picture:
        """Return the image with its luminance in all color channels; itself if it is gray."""
        texels = picture.texels
        if (texels[..., :1] == texels[..., 1:3]).all():
            return picture
        if name not in self._luminances:
            gray = np.rint(texels[..., :3] @ LUMINANCE).astype(np.uint8)
            self._luminances[name] = Picture(np.dstack([gray, gray, gray, texels[..., 3]]), picture.name)
        return self._luminances[name]


def strength(words: str) -> float:
    """Return a bump map's strength, the argument of -bm."""
    given = parse_map(words).options.get("-bm", [])
    return abs(float(given[0])) if given and _is_number(given[0]) else 1.0


def _pair(words: list[str] | None, missing: float) -> tuple[float, float]:
    numbers = [float(word) for word in words or [] if _is_number(word)]
    u, v = (numbers + [missing, missing])[:2] if numbers else (missing, missing)
    return u, v


def _is_number(word: str) -> bool:
    try:
        return abs(float(word)) < 1e30
    except ValueError:
        return False
