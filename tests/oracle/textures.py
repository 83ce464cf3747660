"""Texture look-up, following docs/scene-format.md."""

from __future__ import annotations

import numpy as np

from clrt.scene.light_images import LightImage
from clrt.scene.materials.textures import Texture

from .vectors import Doubles, Whole

CHANNELS = ("red", "green", "blue", "alpha")


def color_at(texture: Texture, uv: Doubles) -> Doubles:
    """Return linear colours times the factor (n, 3) at texture coordinates (n, 2)."""
    return looked_up(texture, texture.wrap, _linear(texture.picture.texels[..., :3] / 255.0), uv) * texture.factor


def number_at(texture: Texture, uv: Doubles) -> Doubles:
    """Return values of its channel times the factor, (n,)."""
    values = texture.picture.texels[..., CHANNELS.index(texture.channel)] / 255.0
    factor: Doubles = np.asarray(texture.factor, float)
    return looked_up(texture, texture.wrap, values[..., None], uv)[:, 0] * factor


def bilinear(grid: Doubles, x: Doubles, y: Doubles, wrap_x: str, wrap_y: str) -> Doubles:
    """Interpolate a grid (h, w, c) whose cell centres are at integers; return (n, c)."""
    left, top = np.floor(x), np.floor(y)
    right_part, lower_part = (x - left)[:, None], (y - top)[:, None]
    height, width = grid.shape[:2]
    columns = [_wrapped(left.astype(int) + i, width, wrap_x) for i in (0, 1)]
    rows = [_wrapped(top.astype(int) + i, height, wrap_y) for i in (0, 1)]
    above, below = (grid[row, columns[0]] * (1 - right_part) + grid[row, columns[1]] * right_part for row in rows)
    return np.asarray(above * (1 - lower_part) + below * lower_part)


def looked_up(texture: Texture | LightImage, wraps: tuple[str, str], grid: Doubles, uv: Doubles) -> Doubles:
    """Return the values (n, c) of a grid (h, w, c) at coordinates (n, 2) that are mapped to it."""
    height, width = grid.shape[:2]
    angle = np.radians(texture.rotation_degrees)
    scaled = uv * texture.scale
    # KHR_texture_transform: scaled, rotated counter-clockwise in a frame whose v points down, translated.
    u = np.cos(angle) * scaled[:, 0] + np.sin(angle) * scaled[:, 1] + texture.offset[0]
    v = -np.sin(angle) * scaled[:, 0] + np.cos(angle) * scaled[:, 1] + texture.offset[1]
    wrap_u, wrap_v = wraps
    if texture.filter == "nearest":
        row = _wrapped(np.floor(v * height).astype(int), height, wrap_v)
        return np.asarray(grid[row, _wrapped(np.floor(u * width).astype(int), width, wrap_u)])
    return bilinear(grid, u * width - 0.5, v * height - 0.5, wrap_u, wrap_v)


def _wrapped(cell: Whole, size: int, wrap: str) -> Whole:
    if wrap == "clamp":
        return np.clip(cell, 0, size - 1)
    if wrap == "mirror":
        cell = cell % (2 * size)
        return np.minimum(cell, 2 * size - 1 - cell)
    return cell % size


def _linear(srgb: Doubles) -> Doubles:
    """Decode sRGB by IEC 61966-2-1."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
