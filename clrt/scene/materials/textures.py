"""Textures: images that a material's parameter is looked up in, by a surface's texture coordinates.

Coordinates are glTF's: (0, 0) is the upper left corner of the image, (1, 1) the lower right one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..fields.limits import Ge, Lt
from ..fields.validated import Validated

Channel = Literal["red", "green", "blue", "alpha"]
Wrap = Literal["repeat", "mirror", "clamp"]
NonNegative = Annotated[float, Ge(0)]
Pair = tuple[float, float]
Value = TypeVar("Value")


@dataclass(frozen=True, eq=False)
class Picture(Validated):
    """Image of a texture. texels: (h, w, 4) uint8, row 0 on top, unassociated alpha. Textures may share one."""

    texels: NDArray[np.uint8]
    name: str = "picture"

    def conflicts(self) -> list[str]:
        if not isinstance(self.texels, np.ndarray) or self.texels.dtype != np.uint8:
            kind = self.texels.dtype if isinstance(self.texels, np.ndarray) else type(self.texels).__name__
            return [f"texels: is {kind}; write a numpy array of uint8"]
        if self.texels.ndim != 3 or self.texels.shape[2] != 4 or 0 in self.texels.shape:
            return [f"texels: has shape {self.texels.shape}; it must be (height, width, 4) with at least one texel"]
        return []


WHITE = Picture(np.full((1, 1, 4), 255, np.uint8), "white")


@dataclass(frozen=True, kw_only=True)
class Texture(Validated):
    """Texture: an image, and its mapping to a surface.

    Colors are decoded from sRGB, numbers are linear and read from one `channel`; `factor`, one number or three,
    multiplies them. The coordinates of `uv_set` are scaled, rotated by `rotation_degrees` (counter-clockwise on the
    upright image), and translated by `offset`, as in KHR_texture_transform. filter: bilinear, or the nearest texel.
    """

    remedy: ClassVar[str] = 'write { image = "FILE" }'
    picture: Picture
    factor: NonNegative | tuple[NonNegative, NonNegative, NonNegative] = 1.0
    channel: Channel = "red"
    uv_set: Annotated[int, Ge(0), Lt(2)] = 0
    offset: Pair = (0.0, 0.0)
    scale: Pair = (1.0, 1.0)
    rotation_degrees: float = 0.0
    wrap: tuple[Wrap, Wrap] = ("repeat", "repeat")
    filter: Literal["linear", "nearest"] = "linear"

    @property
    def to_picture(self) -> NDArray[np.float64]:
        """The matrix (2, 3) from (u, v, 1) to image coordinates, both from 0 to 1."""
        return picture_matrix(self.scale, self.rotation_degrees, self.offset)

    @property
    def image_axes(self) -> NDArray[np.float64]:
        """(2, 2): unit vectors to the image's right and up, on the plane of u and −v."""
        (a, b), (c, d) = self.to_picture[:, :2]
        axes = np.array([np.sign(a * d - b * c) * np.array([d, c]), [-c, d]])
        return np.asarray(axes / np.hypot(c, d))


def picture_matrix(scale: Pair, rotation_degrees: float, offset: Pair) -> NDArray[np.float64]:
    """Return the matrix (2, 3) that scales coordinates (u, v, 1), rotates and translates them (see `Texture`)."""
    angle = np.radians(rotation_degrees)
    c, s = np.cos(angle), np.sin(angle)
    turned = np.array([[c, s], [-s, c]]) @ np.diag(scale)
    return np.column_stack([turned, offset])


def untextured(value: Value | Texture) -> Value:
    """Return a material's parameter that must not be a texture; raises ValueError if it is one."""
    if isinstance(value, Texture):
        raise ValueError(f"the texture {value.picture.name}")
    return value
