"""Which skies are sampled as lights: those where that made the squared error, times the time that it took, smaller."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.rendering.compile.lights.environment_map import pack_sky
from clrt.scene.default_sky import default_sky
from clrt.scene.model import Environment

from . import skies

Doubles = NDArray[np.float64]
GLOW = np.array([0.6, 0.8, 0.0])


def sky(brightness: Callable[[Doubles], Doubles]) -> Environment:
    """Grey, as bright as the function says of directions (n, 3)."""
    v, u = np.meshgrid((np.arange(64) + 0.5) / 64, (np.arange(128) + 0.5) / 128, indexing="ij")
    grey = brightness(skies.from_uv(u.ravel(), v.ravel())).reshape(64, 128, 1)
    return Environment(image=np.repeat(grey, 3, axis=2).astype(np.float32))


def day(sun: float) -> Environment:
    """Grey over darker ground, and a sun of 9 texels, 0.013 sr: `sun` of 20 adds 7 % to all light."""
    plain = sky(lambda w: np.where(w[:, 1] > 0, 0.5, 0.12)).image
    assert plain is not None
    image = plain.copy()
    image[12:15, 90:93] = sun
    return Environment(image=image)


@pytest.mark.parametrize("strength", [1e-30, 1.0, 1e30])
@pytest.mark.parametrize(
    "environment",
    [
        day(20),
        day(5),
        sky(lambda w: 1 + 4 * np.maximum(w @ GLOW, 0) ** 8),
        sky(lambda w: 1 + 4 * np.maximum(w @ GLOW, 0) ** 40),
        sky(lambda w: np.where(w @ GLOW > 0.3, 1.0, 0.01)),
    ],
    ids=["small sun", "dim sun", "glow", "narrow glow", "third"],
)
def test_sampled(environment: Environment, strength: float) -> None:
    assert pack_sky(Environment(image=environment.image, strength=strength)).irradiance is not None


@pytest.mark.parametrize("strength", [1e-30, 1.0, 1e30])
@pytest.mark.parametrize(
    "environment",
    [
        default_sky(),
        default_sky(512),
        sky(lambda w: 1 + 0.9 * w[:, 1]),
        sky(lambda w: np.where(w[:, 1] > 0, 1.0, 0.01)),
        sky(lambda w: 1 + np.maximum(w @ GLOW, 0) ** 40),
        day(0.5),
    ],
    ids=["default", "finer default", "gradient", "half", "weak glow", "no sun"],
)
def test_left_to_the_surfaces_own_directions(environment: Environment, strength: float) -> None:
    assert pack_sky(Environment(image=environment.image, strength=strength)).irradiance is None
