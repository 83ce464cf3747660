"""Packs the sky: its radiance, and for a picture the table by which directions are drawn."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..scene.model import Environment
from .alias import alias_table
from .records import ENVIRONMENT, SKY_ALIAS, SKY_TEXEL

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


@dataclass(frozen=True)
class Sky:
    """What the kernels get of the environment: a file (None: a black sky), buffers, and ∫L dω of its luminance."""

    kernel: str | None
    buffers: dict[str, tuple[str, NDArray[Any]]]
    power: float

    @property
    def sampled(self) -> bool:
        """Whether it is in the light table; a constant sky is left to the surfaces' own directions."""
        return self.kernel == "light/image_sky.cl"


def pack_sky(environment: Environment) -> Sky:
    """The sky of an Environment."""
    record = np.zeros(1, ENVIRONMENT)
    image = environment.image
    if image is None:
        color = np.asarray(environment.color) * environment.strength
        if not color.any():
            return Sky(None, {}, 0.0)
        record["color"] = color
        power = float(4 * np.pi * LUMINANCE @ color)
        return Sky("light/constant_sky.cl", {"environment": ("Environment", record)}, power)
    radiance = image.astype(np.float64) * environment.strength
    weights = _texel_weights(radiance)
    if not weights.any():
        return Sky(None, {}, 0.0)
    height, width = weights.shape
    angle = np.radians(environment.rotation_degrees)
    record["width"], record["height"] = width, height
    record["rotation_cos"], record["rotation_sin"] = np.cos(angle), np.sin(angle)
    threshold, alias, probability = alias_table(weights.ravel())
    texels = np.zeros(width * height, SKY_TEXEL)
    texels["radiance"] = radiance.reshape(-1, 3)
    texels["density"] = probability * (width * height)
    aliases = np.zeros(width * height, SKY_ALIAS)
    aliases["threshold"], aliases["alias"] = threshold, alias
    buffers: dict[str, tuple[str, NDArray[Any]]] = {
        "environment": ("Environment", record), "sky_texels": ("SkyTexel", texels),
        "sky_aliases": ("SkyAlias", aliases)}
    return Sky("light/image_sky.cl", buffers, float(weights.sum()))


def _texel_weights(radiance: NDArray[np.float64]) -> NDArray[np.float64]:
    """(h, w): mean of the bilinear luminance over each texel, times the texel's solid angle.

    Between texel centres the bilinear weights average to 1/8, 3/4, 1/8 over a texel, in each direction.
    """
    luminance = radiance @ LUMINANCE
    rows = 0.75 * luminance + 0.125 * (np.roll(luminance, 1, axis=1) + np.roll(luminance, -1, axis=1))
    padded = np.pad(rows, ((1, 1), (0, 0)), mode="edge")
    mean = 0.75 * rows + 0.125 * (padded[:-2] + padded[2:])
    height, width = mean.shape
    edges = np.cos(np.pi * np.arange(height + 1) / height)
    return np.asarray(mean * (edges[:-1] - edges[1:])[:, None] * (2 * np.pi / width))
