"""Emitters in the same place as an earlier opaque one, such as those of an object that was copied and never moved.

Rays find the first of several hits at one distance (kernels/traverse/trace.cl), so the others are never seen, and must
not be sampled either.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ....scene.materials.material import Material


def hidden_lights(shapes: NDArray[np.float64], opaque: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which of n shapes, (n, k) numbers that define each, equal an earlier one that is opaque; opaque: (n,)."""
    rows = np.ascontiguousarray(shapes + 0.0).view(np.uint64).reshape(shapes.shape)  # + 0.0: -0 becomes 0
    factors = np.random.default_rng(0).integers(1 << 62, size=shapes.shape[1]).astype(np.uint64) * 2 + 1
    _, group = np.unique((rows * factors).sum(axis=1, dtype=np.uint64), return_inverse=True)
    number = np.arange(len(rows))
    first = np.full(len(rows), len(rows))
    np.minimum.at(first, group[opaque], number[opaque])
    before = np.minimum(first[group], number)
    return np.asarray((before < number) & (rows[before] == rows).all(axis=1))


def opaque_and_sides(materials: Sequence[Material]) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Return which of n materials are opaque, (n,), and numbers that differ if their sides do, (n, 2): one of two
    surfaces in one place hides the other only if both are visible from the same sides."""
    opaque = np.array([material.opacity == 1 for material in materials], bool)
    sides = np.array([(material.one_sided, material.double_sided) for material in materials], np.float64)
    return opaque, sides.reshape(-1, 2)
