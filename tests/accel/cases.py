"""Triangle soups, regular and adversarial, as (m, 3, 3) float32 corners."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from clrt.accel.bvh import FloatArray
from clrt.scene.geometry.scaling import unit_for


def soup(count: int, size: float = 0.1, seed: int = 0) -> FloatArray:
    """Return random triangles of about `size` in the unit cube."""
    rng = np.random.default_rng(seed)
    corners: FloatArray = (rng.random((count, 1, 3)) + size * (rng.random((count, 3, 3)) - 0.5)).astype(np.float32)
    return corners


def edges(triangles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the low and high corners (m, 3) of triangle boxes in a BVH, padded by 2^-21 of their longest side."""
    low, high = triangles.min(axis=1).astype(np.float64), triangles.max(axis=1).astype(np.float64)
    pad = (high - low).max(axis=1, keepdims=True, initial=0).astype(np.float32).astype(np.float64) / 2**21
    return (low - pad).astype(np.float32), (high + pad).astype(np.float32)


def spheres(count: int, seed: int = 0) -> FloatArray:
    """Return random spheres, (s, 4) center and radius, in the unit cube."""
    rng = np.random.default_rng(seed)
    return np.hstack([rng.random((count, 3)), rng.uniform(0.01, 0.1, (count, 1))]).astype(np.float32)


def grid(side: int) -> FloatArray:
    """Return 2·side² triangles that fill the unit square of the plane y = 0."""
    z, x = np.divmod(np.arange(side * side), side)
    corner = np.stack([x, 0 * x, z], axis=-1)[:, None]
    lower, upper = np.array([[0, 0, 0], [1, 0, 0], [1, 0, 1]]), np.array([[0, 0, 0], [1, 0, 1], [0, 0, 1]])
    return (np.concatenate([corner + lower, corner + upper]) / side).astype(np.float32)


def _concentric(count: int) -> FloatArray:
    """Return triangles of all sizes whose boxes are concentric."""
    size = np.arange(1, count + 1, dtype=np.float32)[:, None, None]
    return size * np.array([[-1, -1, -1], [1, 1, 1], [-1, 1, 0]], np.float32)


def _exponential(ratio: float, count: int) -> FloatArray:
    """Return triangles, each `ratio` times as far from the origin and as large as the previous one."""
    size = (ratio ** np.arange(-count / 2, count / 2)).astype(np.float32)[:, None, None]
    return size * np.array([[1, 1, 1], [1.2, 1, 1], [1, 1.2, 1]], np.float32)


def _line(count: int) -> FloatArray:
    """Return triangles without area, one point each, along x."""
    corners = np.zeros((count, 3, 3), np.float32)
    corners[..., 0] = np.linspace(0, 1, count)[:, None]
    return corners


def box(low: ArrayLike, high: ArrayLike) -> FloatArray:
    """Return the six sides of a box, two triangles each."""
    sides = []
    for axis in range(3):
        for side in (0, 1):
            square = np.insert(np.array([[0, 0], [1, 0], [1, 1], [0, 1]]), axis, side, axis=1)
            sides += [square[[0, 1, 2]], square[[0, 2, 3]]]
    return np.where(sides, high, low).astype(np.float32)


NASTY: dict[str, FloatArray] = {
    "none": soup(0),
    "one": soup(1),
    "two": soup(2),
    "soup": soup(500),
    "duplicates": np.repeat(soup(40), 64, axis=0),
    "equal_centroids": _concentric(10_000),
    "points": np.ones((1000, 3, 3), np.float32),
    "line": _line(1000),
    "exponential": _exponential(1.9, 270),
    "teapot_in_a_stadium": np.concatenate([soup(2000) * np.float32(1e-5), grid(10) * np.float32(1e5)]),
    "flat_grid": grid(60),
    "long_diagonals": np.concatenate([soup(300, 0.001), soup(300, 20.0)]),
    "far_away": soup(500) + np.float32(1e6),
    "enormous": np.concatenate([soup(200) * np.float32(3e38), soup(200) * np.float32(-3e38), soup(200)]),
    "offset_1e30": soup(300, 1e-3) * np.float32(1e25) + np.float32(1e30),
    "denormal": soup(500) * np.float32(1e-42),
}


def scaled(triangles: FloatArray) -> FloatArray:
    """Scale by a power of two to about 1, as scenes are packed."""
    return (triangles * np.float64(unit_for(float(np.abs(triangles).max())))).astype(np.float32)


NO_SPHERES = spheres(0)
#: Triangles and spheres, at least two in all, as input of a device's builder.
SCENES: dict[str, tuple[FloatArray, FloatArray]] = {
    name: (scaled(triangles), NO_SPHERES) for name, triangles in NASTY.items() if len(triangles) > 1
}
SCENES |= {
    "eight": (soup(8), NO_SPHERES),
    "nine": (soup(9), NO_SPHERES),
    "blocks": (soup(20_000, 0.01), spheres(37)),
    "room": (np.concatenate([soup(2000, 0.01) * np.float32(0.3), box(-1, 1)]), NO_SPHERES),
    "mixed": (soup(600), spheres(300)),
    "one_of_each": (soup(1), spheres(1)),
    "spheres": (soup(0), spheres(700)),
    "equal_spheres": (soup(0), np.repeat(spheres(3), 50, axis=0)),
}
