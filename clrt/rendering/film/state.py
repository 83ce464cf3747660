"""State that a render yields while it progresses."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import sqrt
from os import PathLike
from typing import cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...errors import UsageError
from ...float_errors import with_default_errors
from ...scene.fields.number_arrays import real_array
from .film import RELATIVE_FLOOR, Film


@dataclass(frozen=True)
class State:
    """Image so far.

    - spp: samples per pixel, the mean if sampling is adaptive; seconds: render time
    - noise: estimated √relMSE; None below 2 samples
    - relmse: against the reference, if given
    - film: the sums of the samples
    - tile_noise: the renderer's percentile of the tiles' estimated √relMSE, if it has one
    """

    spp: int
    seconds: float
    noise: float | None
    relmse: float | None
    film: Film
    tile_noise: float | None = None

    @property
    def stops_by(self) -> float | None:
        """The error that is compared with the target error."""
        return self.noise if self.tile_noise is None else self.tile_noise

    @property
    def noise_ratio(self) -> float | None:
        """Estimated over true √relMSE, if both are known."""
        return self.noise / sqrt(self.relmse) if self.noise is not None and self.relmse else None

    @cached_property
    @with_default_errors
    def pixels(self) -> NDArray[np.float32]:
        """(height, width, 3) float32, linear Rec. 709."""
        return self.film.picture()

    @cached_property
    @with_default_errors
    def alpha(self) -> NDArray[np.float32] | None:
        """(height, width) float32, the fraction of each pixel that the scene covers: of a transparent image, for which
        `pixels` are premultiplied, and of one with a backdrop; else None."""
        return None if self.film.alpha is None else self.film.alpha.astype(np.float32)


def check_reference(reference: object, size: tuple[int, int]) -> None:
    """Raise UsageError unless it is None, or comparable with an image of (width, height)."""
    if reference is None:
        return
    if isinstance(reference, (str, PathLike)):
        raise UsageError(f"reference is the path {str(reference)!r}; read it with clrt.read_image")
    shape = real_array("reference", cast(ArrayLike, reference)).shape
    if not isinstance(reference, np.ndarray) or shape != (*size[::-1], 3):
        raise UsageError(
            f"reference is a {type(reference).__name__} of shape {shape}; give a numpy array of the "
            f"image's shape, {(*size[::-1], 3)}"
        )
    if bad := int(np.count_nonzero(~np.isfinite(reference).all(2))):
        raise UsageError(
            f"reference has pixels that are NaN or infinite ({bad} of {size[0] * size[1]}), so no error "
            "can be measured against it; render it again"
        )


def relmse(film: Film, reference: NDArray[np.float32] | None) -> float | None:
    """Return the relMSE of the film's mean against a reference (height, width, 3), if there is one."""
    if reference is None:
        return None
    expected = reference.astype(np.float64)
    return float(np.mean((film.mean - expected) ** 2 / (expected**2 + RELATIVE_FLOOR)))
