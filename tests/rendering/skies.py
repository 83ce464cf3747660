"""Equirectangular environment maps in float64, in the scene file's convention: look-up, directions, irradiance."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]


def lookup(image: NDArray[np.float32], w: Doubles, rotation_degrees: float = 0.0) -> Doubles:
    """Return the radiance (n, 3) from unit directions w (n, 3).

    u = atan2(x, −z)/2·pi mod 1, v = acos(y)/pi; texel centres at ((column + ½)/width, (row + ½)/height); bilinear, u
    wraps, v clamps. The map rotates counter-clockwise seen from above, +Y, so directions are rotated back first.
    """
    u, v = to_uv(turned(w, -rotation_degrees))
    height, width = image.shape[:2]
    x, y = u * width - 0.5, v * height - 0.5
    column, row = np.floor(x).astype(int), np.floor(y).astype(int)
    fx, fy = (x - column)[:, None], (y - row)[:, None]
    texel = image.astype(np.float64)
    rows = [np.clip(row + i, 0, height - 1) for i in (0, 1)]
    columns = [(column + i) % width for i in (0, 1)]
    upper, lower = (texel[r, columns[0]] * (1 - fx) + texel[r, columns[1]] * fx for r in rows)
    return np.asarray(upper * (1 - fy) + lower * fy)


def to_uv(w: Doubles) -> tuple[Doubles, Doubles]:
    x, y, z = w.T
    return np.arctan2(x, -z) / (2 * np.pi) % 1, np.arccos(np.clip(y, -1, 1)) / np.pi


def from_uv(u: Doubles, v: Doubles) -> Doubles:
    sine = np.sin(np.pi * v)
    return np.stack([sine * np.sin(2 * np.pi * u), np.cos(np.pi * v), -sine * np.cos(2 * np.pi * u)], axis=-1)


def turned(w: Doubles, degrees: float) -> Doubles:
    """Rotate about +Y, counter-clockwise seen from above: +Z goes towards +X."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.asarray(w @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]).T)


def irradiance(
    image: NDArray[np.float32],
    normal: Doubles,
    rotation_degrees: float = 0.0,
    steps: int = 24,
    where: NDArray[np.bool_] | None = None,
) -> Doubles:
    """Return ∫ L max(w·normal, 0) dω (3,), by the midpoint rule with steps² points per texel,
    over the texels in `where`.
    """
    height, width = image.shape[:2]
    u = (np.arange(width * steps) + 0.5) / (width * steps)
    v = (np.arange(height * steps) + 0.5) / (height * steps)
    grid_u, grid_v = (grid.ravel() for grid in np.meshgrid(u, v))
    w = from_uv(grid_u, grid_v)
    weight = np.maximum(turned(w, rotation_degrees) @ normal, 0) * np.sin(np.pi * grid_v)
    if where is not None:
        weight *= np.kron(where, np.ones((steps, steps))).ravel()
    return np.asarray(lookup(image, w).T @ weight * 2 * np.pi**2 / len(w))
