"""Default lighting for a model without lights: a clear sky over dark ground, and the sun."""

from __future__ import annotations

import numpy as np

from .lights import DirectionalLight
from .model import Environment

#: The ground is dark because the default camera sees it behind the model: white paper, whose radiance is near 1 in the
#: sun and 0.3 in the shade, contrasts with it; against a bright background its outline would disappear.
ZENITH, HORIZON, GROUND = (0.15, 0.22, 0.36), (0.52, 0.54, 0.55), (0.05, 0.046, 0.042)
#: Falloff of the brightness below the horizon: by a factor of e per elevation whose sine is 1/12, about 5°.
FADE = 12.0

#: From the upper left for a viewer who looks along −Z. With the sky, white paper facing the sun has a radiance near 1.
SUN = DirectionalLight(direction=(0.8, -1.0, -0.55), irradiance=(2.6, 2.4, 2.05), angle_degrees=0.53)


def default_sky(height: int = 32) -> Environment:
    """Return a latitude–longitude image, (height, 2·height, 3): blue zenith, bright horizon, dark grey-brown ground.

    The sky darkens with the square root of the elevation's sine; the ground darkens away from the horizon.
    """
    elevation = np.sin(np.pi / 2 - np.pi * (np.arange(height) + 0.5) / height)[:, None]
    sky = np.array(HORIZON) + np.sqrt(np.maximum(elevation, 0)) * np.subtract(ZENITH, HORIZON)
    ground = np.array(GROUND) + np.exp(FADE * np.minimum(elevation, 0)) * np.subtract(HORIZON, GROUND)
    rows = np.where(elevation > 0, sky, ground).astype(np.float32)
    return Environment(image=np.repeat(rows[:, None], 2 * height, axis=1))
