"""Axes of cameras, and of lights with an image, in the world."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .notes import Statement

#: Tolerance for a camera's axes to be orthogonal and equally long.
ODD = 1e-4


def lengths_of(
    camera: Statement, axes: NDArray[np.float64], transform: str, what: str = "camera"
) -> tuple[float, float, float]:
    """Return the lengths of a camera's axes, the columns (3, 3); these must be orthogonal and not stretch the image.
    what: a light instead."""
    x, y, z = np.linalg.norm(axes, axis=0).tolist()
    if (
        min(x, y, z) == 0
        or np.abs((axes / (x, y, z)).T @ (axes / (x, y, z)) - np.eye(3)).max() > ODD
        or (abs(x - y) > ODD * x)
    ):
        camera.refuse(
            f"{transform} shears or stretches the image",
            "only rotate, translate and scale uniformly",
            f"{what} that shears or stretches",
        )
    return x, y, z
