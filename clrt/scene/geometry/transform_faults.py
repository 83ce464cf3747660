"""Validation of affine transforms."""

from __future__ import annotations

from math import hypot

import numpy as np
from numpy.typing import NDArray

from ..fields.field_types import FLOAT32_MAX
from ..fields.valid_arrays import faults_once

#: A transform is singular if it scales volumes by less than this, relative to the cube of its longest column.
SINGULAR = 1e-12
#: Far from singular, and from the limits of float32 if it is moved by numbers that are not larger either.
REGULAR, MODERATE = 1e-6, 1e18


def transform_faults(to_world: NDArray[np.float64]) -> dict[str, NDArray[np.bool_]]:
    """Return which affine transforms (k, 3, 4) cannot be inverted, (k,), by a description of the fault."""
    with np.errstate(all="ignore"):
        length = np.linalg.norm(to_world[..., :3], axis=1).max(axis=1, initial=0)
        volume = np.abs(np.linalg.det(to_world[..., :3] / np.maximum(length, 1e-300)[:, None, None]))
    finite = np.isfinite(to_world).all(axis=(1, 2))
    return {"is not finite": ~finite, "flattens the mesh": finite & ~(volume > SINGULAR)}


def placement_faults(to_world: NDArray[np.float64], vertices: NDArray[np.float32]) -> list[str]:
    """Return why vertices (n, 3) cannot be placed by a transform (3, 4), in a few words; most pass a fast test."""
    if _is_regular(to_world) and not faults_once(vertices, "moderate", lambda: _large(vertices)):
        return []
    if faults := [fault for fault, wrong in transform_faults(to_world[None]).items() if wrong[0]]:
        return faults
    with np.errstate(all="ignore"):
        reach = np.abs(to_world[:, :3]) @ np.abs(vertices).max(axis=0).astype(np.float64) + np.abs(to_world[:, 3])
    return ["moves the mesh outside the range of float32"] if (reach > FLOAT32_MAX).any() else []


def are_mirrored(one: NDArray[np.float64], other: NDArray[np.float64]) -> bool:
    """Return whether one of two invertible transforms (3, 4) mirrors, and the other does not."""
    return bool(np.linalg.det(one[:, :3]) * np.linalg.det(other[:, :3]) < 0)


def _is_regular(to_world: NDArray[np.float64]) -> bool:
    (a, b, c, x), (d, e, f, y), (g, h, i, z) = to_world.tolist()
    length = max(hypot(a, d, g), hypot(b, e, h), hypot(c, f, i))
    volume = abs(a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g))
    return bool(volume > REGULAR * length**3 and max(length, abs(x), abs(y), abs(z)) < MODERATE)


def _large(vertices: NDArray[np.float32]) -> list[str]:
    return [] if np.abs(vertices).max(initial=0) < MODERATE else ["is large"]
