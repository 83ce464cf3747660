"""The light for a model that comes without any: a clear sky over brown ground, and the sun."""

from __future__ import annotations

import numpy as np

from .lights import DirectionalLight
from .model import Environment

ZENITH, HORIZON, GROUND = (0.15, 0.23, 0.40), (0.52, 0.54, 0.55), (0.14, 0.125, 0.11)

#: From the upper left of someone who looks along −Z. With the sky, white paper facing the sun has a radiance near 1.
SUN = DirectionalLight(direction=(0.7, -1.0, -0.6), irradiance=(2.5, 2.3, 2.0))


def default_sky(height: int = 32) -> Environment:
    """A latitude–longitude image, (height, 2·height, 3): blue zenith, bright horizon, grey-brown ground.

    The sky darkens with the square root of the elevation's sine; the ground darkens away from the horizon.
    """
    elevation = np.sin(np.pi / 2 - np.pi * (np.arange(height) + 0.5) / height)[:, None]
    sky = np.array(HORIZON) + np.sqrt(np.maximum(elevation, 0)) * np.subtract(ZENITH, HORIZON)
    ground = np.array(GROUND) + np.exp(5 * np.minimum(elevation, 0)) * np.subtract(HORIZON, GROUND)
    rows = np.where(elevation > 0, sky, ground).astype(np.float32)
    return Environment(image=np.repeat(rows[:, None], 2 * height, axis=1))
