"""Orientation of the images of lights."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...scene.light_images import LightImage

Doubles = NDArray[np.float64]


def oriented(image: LightImage | None, right: Doubles, top: Doubles, forward: Doubles) -> dict[str, Any]:
    """Return the direction, up and image of a light whose image has these axes (3,), orthogonal, in the world: clrt's
    right is forward × up, so others are mirrored."""
    mirrors = float(right @ np.cross(forward, top)) < 0
    return {
        "direction": tuple(forward.tolist()),
        "up": tuple(top.tolist()),
        "image": image.mirrored() if image and mirrors else image,
    }
