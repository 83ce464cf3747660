"""The sky's radiance as an environment map."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..model import FloatArray
from .hosek_wilkie import SkyRadiance

Doubles = NDArray[np.float64]
#: Rows of the environment map.
ROWS = 512


def sky_image(
    towards_sun: Doubles, zenith: Doubles, turbidity: float, albedo: Sequence[float], rows: int = ROWS
) -> FloatArray:
    """Return an environment map (rows, 2·rows, 3) of the sky without the sun's disc, black below the horizon and, if
    the sun is below it, everywhere. towards_sun, zenith: unit vectors."""
    theta, phi = np.pi * (np.arange(rows) + 0.5) / rows, np.pi * (np.arange(2 * rows) + 0.5) / rows
    image = np.zeros((rows, 2 * rows, 3), np.float32)
    elevation = np.degrees(np.arcsin(np.clip(towards_sun @ zenith, -1, 1)))
    if elevation < 0:
        return image
    sky = SkyRadiance(float(elevation), turbidity, albedo)
    across, high = np.sin(theta)[:, None], np.broadcast_to(np.cos(theta)[:, None], (rows, 2 * rows))
    directions = np.stack([across * np.sin(phi), high, -across * np.cos(phi)], axis=2)
    cosine, of_sun = directions @ zenith, np.clip(directions @ towards_sun, -1, 1)
    above = cosine > 0
    image[above] = sky.at(cosine[above], np.arccos(of_sun[above]))
    return image


def horizontal_irradiance(image: FloatArray) -> Doubles:
    """Return the irradiance (3,) of the ground by the upper half of an environment map, linear between its rows."""
    rows, columns = image.shape[:2]
    edges = np.sin(np.pi * np.arange(rows // 2 + 1) / rows) ** 2 / 2
    return np.asarray(np.diff(edges) * 2 * np.pi / columns @ image[: rows // 2].sum(axis=1, dtype=np.float64))
