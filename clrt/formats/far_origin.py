"""Models far from the origin: geographic coordinates, of which float32 would keep too few digits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..scene.model import Vector

#: A model is moved to the origin if its center is this many times its size away: float32 would resolve less than a
#: 16 000th of its size.
FAR = 1000.0


def far_center(low: NDArray[np.floating], high: NDArray[np.floating]) -> Vector:
    """Return the center of a bounding box, rounded to float32, if it is far from the origin; else the origin.

    low, high: (3,). Subtracting it from float32 coordinates is exact (Sterbenz 1974).
    """
    low, high = low.astype(np.float64), high.astype(np.float64)
    middle = low / 2 + high / 2
    if not np.isfinite(middle).all() or np.abs(middle).max() <= FAR * (high - low).max():
        return (0.0, 0.0, 0.0)
    x, y, z = middle.astype(np.float32).tolist()
    return x, y, z
