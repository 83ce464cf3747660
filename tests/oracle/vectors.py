"""Operations on rows of 3-vectors, (n, 3) float64."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]
Bools = NDArray[np.bool_]
Whole = NDArray[np.int64]


def dot(a: Doubles, b: Doubles) -> Doubles:
    """Return the scalar products of rows, (n,)."""
    return np.asarray(np.einsum("...i,...i->...", a, b))


def unit(a: Doubles) -> Doubles:
    """Return rows divided by their lengths."""
    return np.asarray(a / np.linalg.norm(a, axis=-1, keepdims=True))


class Frame:
    """Right-handed orthonormal frames around unit normals (n, 3), which are their third axes."""

    def __init__(self, normal: Doubles) -> None:
        along_x = np.abs(normal[:, :1]) < 0.6
        self.x = unit(np.cross(np.where(along_x, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]), normal))
        self.y = np.cross(normal, self.x)
        self.z = normal

    def to_local(self, v: Doubles) -> Doubles:
        return np.column_stack([dot(v, self.x), dot(v, self.y), dot(v, self.z)])

    def to_world(self, v: Doubles) -> Doubles:
        return v[:, :1] * self.x + v[:, 1:2] * self.y + v[:, 2:] * self.z
