"""The light for a model that comes without any: a clear sky over brown ground, and the sun."""

from __future__ import annotations

import numpy as np

from .lights import DirectionalLight
from .model import Environment

ZENITH, HORIZON, GROUND = (0.18, 0.32, 0.62), (0.75, 0.78, 0.80), (0.20, 0.18, 0.16)

#: From the upper left of someone who looks along −Z. With the sky, white paper facing the sun has a radiance near 1.
SUN = DirectionalLight(direction=(0.55, -1.0, -0.65), irradiance=(1.9, 1.75, 1.5))


def default_sky(height: int = 32) -> Environment:
    """A latitude–longitude image, (height, 2·height, 3): blue zenith, bright horizon, grey-brown ground.

    The sky darkens with the square root of the elevation's sine; the ground sets in just below the horizon.
    """
    elevation = np.sin(np.pi / 2 - np.pi * (np.arange(height) + 0.5) / height)[:, None]
    sky = np.array(HORIZON) + np.sqrt(np.maximum(elevation, 0)) * np.subtract(ZENITH, HORIZON)
    ground = np.array(GROUND) + np.exp(12 * np.minimum(elevation, 0)) * np.subtract(HORIZON, GROUND)
    rows = np.where(elevation > 0, sky, ground).astype(np.float32)
    return Environment(image=np.repeat(rows[:, None], 2 * height, axis=1))
