"""Textures in the scene file: `color = { image = "wood.png", scale = [2, 2] }`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...errors import SceneError
from ...scene.materials.textures import Channel, NonNegative, Pair, Picture, Texture, Wrap
from ...scene.validation.field_types import field_problems, show, usable
from ..images.image_reader import read_texels


@dataclass(frozen=True, kw_only=True)
class TextureTable:
    """Keys of a texture table, as in Texture; `wrap` may be one word for both directions, `scale` one number."""

    image: str
    factor: NonNegative | tuple[NonNegative, NonNegative, NonNegative] = 1.0
    channel: Channel = "red"
    uv_set: int = 0
    offset: Pair = (0.0, 0.0)
    scale: Pair = (1.0, 1.0)
    rotation_degrees: float = 0.0
    wrap: tuple[Wrap, Wrap] = ("repeat", "repeat")
    filter: str = "linear"


class TextureReader:
    """Reader for the textures of one scene file, each image once."""

    def __init__(self, folder: Path) -> None:
        """Create a reader; the tables' files are relative to `folder`."""
        self._folder = folder
        #: Images read so far, by file name.
        self.pictures: dict[str, Picture] = {}

    def read(self, values: Mapping[str, Any], where: str) -> Texture:
        """Read a texture. Raises SceneError with all that is wrong with the table or its image."""
        values = dict(values)
        if isinstance(wrap := values.get("wrap"), str):
            values["wrap"] = (wrap, wrap)
        if isinstance(scale := values.get("scale"), int | float):
            values["scale"] = (scale, scale)
        problems = field_problems(TextureTable, values, where)
        name = values.pop("image", "")
        if not isinstance(name, str):
            problems.append(f"{where}.image: {show(name)} is not a string; write a file name in quotes")
        if problems:
            raise SceneError(problems)
        if name not in self.pictures:
            try:
                self.pictures[name] = Picture(read_texels(self._folder / name), name)
            except SceneError as error:
                raise SceneError([f"{where}.image: {problem}" for problem in error.problems]) from None
        return Texture(picture=self.pictures[name], **usable(TextureTable, values))
