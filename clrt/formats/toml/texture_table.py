"""Textures in the scene file: `color = { image = "wood.png", scale = [2, 2] }`, and images of lights."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ...errors import ObjectError, SceneError
from ...scene.fields.field_types import field_problems, show, usable
from ...scene.fields.number_arrays import read_only
from ...scene.light_images import LightImage
from ...scene.materials.textures import Channel, NonNegative, Pair, Picture, Texture, Wrap
from ..images.image_reader import read_picture, read_texels


@dataclass(frozen=True, kw_only=True)
class TextureTable:
    """Keys of a texture table, as in Texture; `wrap` may be one word for both directions, `scale` one number."""

    image: Any  # a string; its problem says that it is the name of a file
    factor: NonNegative | tuple[NonNegative, NonNegative, NonNegative] = 1.0
    channel: Channel = "red"
    uv_set: int = 0
    offset: Pair = (0.0, 0.0)
    scale: Pair = (1.0, 1.0)
    rotation_degrees: float = 0.0
    wrap: tuple[Wrap, Wrap] = ("repeat", "repeat")
    filter: str = "linear"


@dataclass(frozen=True, kw_only=True)
class LightImageTable:
    """Keys of the table of a light's image, as in LightImage; `wrap` and `scale` as in TextureTable."""

    image: Any  # a string; its problem says that it is the name of a file
    offset: Pair = (0.0, 0.0)
    scale: Pair = (1.0, 1.0)
    rotation_degrees: float = 0.0
    wrap: tuple[Wrap, Wrap] | None = None
    filter: Literal["linear", "nearest"] = "linear"


class TextureReader:
    """Reader for the textures and lights' images of one scene file, each image once."""

    def __init__(self, folder: Path) -> None:
        """Create a reader; the tables' files are relative to `folder`."""
        self._folder = folder
        #: Images read so far, by file name.
        self.pictures: dict[str, Picture] = {}
        #: Pixels of lights' images read so far, by file name.
        self.pixels: dict[str, NDArray[np.float32]] = {}

    def read(self, values: Mapping[str, Any], where: str) -> Texture:
        """Read a texture. Raises SceneError with all that is wrong with the table or its image."""
        values, name = _checked(TextureTable, values, where)
        if name not in self.pictures:
            with _blaming(where):
                self.pictures[name] = Picture(read_texels(self._folder / name), name)
        return Texture(picture=self.pictures[name], **usable(TextureTable, values))

    def light_image(self, values: Mapping[str, Any], where: str) -> LightImage:
        """Read the image of a light. Raises SceneError likewise."""
        values, name = _checked(LightImageTable, values, where)
        if name not in self.pixels:
            with _blaming(where):
                self.pixels[name] = read_only(read_picture(self._folder / name))
        try:
            return LightImage(pixels=self.pixels[name], name=name, **usable(LightImageTable, values))
        except ObjectError as error:
            raise SceneError(error.named(f"{where}.image")) from None


def _checked(kind: type, values: Mapping[str, Any], where: str) -> tuple[dict[str, Any], str]:
    """Return the values of a table of this type without its image, and that image's file name."""
    values = dict(values)
    if isinstance(wrap := values.get("wrap"), str):
        values["wrap"] = (wrap, wrap)
    if isinstance(scale := values.get("scale"), int | float):
        values["scale"] = (scale, scale)
    problems = field_problems(kind, values, where)
    name = values.pop("image", "")
    if not isinstance(name, str):
        problems.append(f"{where}.image: {show(name)} is not a string; write a file name in quotes")
    if problems:
        raise SceneError(problems)
    return values, name


@contextmanager
def _blaming(where: str) -> Iterator[None]:
    """Prefix what is wrong with a file by the key that names it."""
    try:
        yield
    except SceneError as error:
        raise SceneError([f"{where}.image: {problem}" for problem in error.problems]) from None
