"""Textures of Wavefront MTL libraries: `map_Kd -s 2 2 1 wood.png` and the like."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import NamedTuple

from ...errors import SceneError
from ...file_names import printable
from ...scene.materials.textures import Channel, Picture, Texture, Wrap
from ..images.image_reader import read_texels

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


class TextureMap(NamedTuple):
    """A map's file name, and the arguments of its options."""

    file: str
    options: dict[str, list[str]]


def parse_map(words: str) -> TextureMap:
    """Parse a map statement: options first; the rest is the file name, which may contain spaces."""
    rest, options = words.split(), {}
    while rest and (option := rest[0].lower()) in OPTIONS:
        count = 1
        while count < OPTIONS[option] and len(rest) > count + 2 and _is_number(rest[count + 1]):
            count += 1
        options[option] = rest[1 : count + 1]
        rest = rest[count + 1 :]
    return TextureMap(" ".join(rest), options)


class Maps:
    """Reader for the maps of one model's libraries, each image once; file names are relative to the model's folder."""

    def __init__(self, model: Path) -> None:
        self._model = model
        self._pictures: dict[str, Picture | None] = {}

    def texture(self, words: str) -> Texture | None:
        """Return the texture; None, with a warning, if its image cannot be read. In OBJ files v points up."""
        name, options = parse_map(words)
        picture = self._picture(name)
        if picture is None:
            return None
        scale_u, scale_v = _pair(options.get("-s"), 1.0)
        offset_u, offset_v = _pair(options.get("-o"), 0.0)
        wrap: Wrap = "clamp" if options.get("-clamp") == ["on"] else "repeat"
        channel = CHANNELS.get(options.get("-imfchan", ["r"])[0].lower(), "red")
        return Texture(
            picture=picture,
            scale=(scale_u, scale_v),
            offset=(offset_u, 1 - scale_v - offset_v),
            channel=channel,
            wrap=(wrap, wrap),
        )

    def _picture(self, name: str) -> Picture | None:
        if name not in self._pictures:
            try:
                file = self._model.parent / name.replace("\\", "/")
                self._pictures[name] = Picture(read_texels(file), printable(name))
            except (SceneError, OSError, ValueError) as error:
                log.warning("%s: a texture is ignored: %s", self._model, error)
                self._pictures[name] = None
        return self._pictures[name]


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
