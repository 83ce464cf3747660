"""Images of lights: the intensity of a spot light, a projector or a goniometric light over directions."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import NDArray

from .fields.pixels import pixel_faults
from .fields.validated import Validated
from .materials.textures import Pair, Wrap, picture_matrix


@dataclass(frozen=True, eq=False, kw_only=True)
class LightImage(Validated):
    """Image of a light, and its mapping to directions.

    pixels: (h, w, 3) float32, linear Rec. 709, row 0 on top; they multiply the light's intensity. `scale`,
    `rotation_degrees`, `offset` and `filter` are those of `Texture`, of the coordinates from (0, 0), the upper left
    corner of what the light shows, to (1, 1). wrap: values outside the image in u and v; None for the light's own.
    """

    pixels: NDArray[np.float32]
    name: str = "image"
    offset: Pair = (0.0, 0.0)
    scale: Pair = (1.0, 1.0)
    rotation_degrees: float = 0.0
    wrap: tuple[Wrap, Wrap] | None = None
    filter: Literal["linear", "nearest"] = "linear"

    def conflicts(self) -> list[str]:
        return pixel_faults("pixels", self.pixels)

    @property
    def _mapping(self) -> tuple[Any, ...]:
        return self.offset, self.scale, self.rotation_degrees, self.wrap, self.filter

    def __eq__(self, other: object) -> bool:
        """Return whether both have the same pixels and mapping, whatever their names are."""
        if not isinstance(other, LightImage):
            return NotImplemented
        same = self.pixels is other.pixels or np.array_equal(self.pixels, other.pixels)
        return same and self._mapping == other._mapping

    def __hash__(self) -> int:
        return hash((self.pixels.shape, self._mapping))

    @property
    def aspect(self) -> float:
        """Width over height."""
        return float(self.pixels.shape[1] / len(self.pixels))

    @property
    def typical(self) -> NDArray[np.float64]:
        """(3,): the root mean square of the pixels, positive unless they are black."""
        return np.asarray(np.sqrt(np.mean(np.square(self.pixels, dtype=np.float64), axis=(0, 1))))

    @property
    def to_picture(self) -> NDArray[np.float64]:
        """The matrix (2, 3) from (u, v, 1) to image coordinates, both from 0 to 1."""
        return picture_matrix(self.scale, self.rotation_degrees, self.offset)

    def with_wrap(self, wrap: tuple[Wrap, Wrap]) -> Self:
        """Return the image with the light's own `wrap`, unless it has one."""
        return self if self.wrap is not None else replace(self, wrap=wrap)

    def mirrored(self) -> Self:
        """Return the image with left and right exchanged: the coordinate u becomes 1 − u."""
        (a, _, x), (b, _, y) = self.to_picture.tolist()
        return replace(self, scale=(-self.scale[0], self.scale[1]), offset=(x + a, y + b))


#: Image of a light without one: the same intensity in all directions that it shows.
WHITE_IMAGE = LightImage(pixels=np.ones((1, 1, 3), np.float32), name="white")
