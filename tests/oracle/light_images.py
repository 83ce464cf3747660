"""Images of lights, following docs/scene-format.md."""

from __future__ import annotations

import numpy as np

from clrt.scene.light_images import LightImage
from clrt.scene.lights import GoniometricLight, ProjectorLight, SpotLight

from .textures import looked_up
from .vectors import Doubles, dot, unit

Imaged = SpotLight | ProjectorLight | GoniometricLight


def image_factor(light: Imaged, away: Doubles) -> Doubles:
    """Return what multiplies the intensity (n, 3) in unit directions from the light: its image, dark outside it, and
    for an image of irradiance 1/cos³."""
    forward = unit(np.array(light.direction, float))
    right = unit(np.cross(forward, light.up))
    x, y, z = dot(away, right), dot(away, np.cross(right, forward)), dot(away, forward)
    if isinstance(light, GoniometricLight):
        across, down = 0.5 + np.arctan2(x, z) / (2 * np.pi), np.arccos(np.clip(y, -1, 1)) / np.pi
        return _shown(light.image, ("repeat", "clamp"), across, down)
    half, aspect = (
        (light.outer_degrees, 1.0) if isinstance(light, SpotLight) else (light.fov_degrees / 2, _aspect(light))
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        high = z * np.tan(np.radians(half))
        across, down = 0.5 + 0.5 * x / (high * aspect), 0.5 - 0.5 * y / high
    inside = (z > 0) & (across >= 0) & (across <= 1) & (down >= 0) & (down <= 1)
    across, down, z = (np.where(inside, value, 0.5) for value in (across, down, z))
    strength = z**-3 if isinstance(light, ProjectorLight) and light.image_of == "irradiance" else np.ones(len(z))
    return np.where(inside, strength, 0)[:, None] * _shown(light.image, ("clamp", "clamp"), across, down)


def _shown(image: LightImage | None, wrap: tuple[str, str], u: Doubles, v: Doubles) -> Doubles:
    """Return the image (n, 3), white if there is none; wrap: the light's own."""
    if image is None:
        return np.ones((len(u), 3))
    return looked_up(image, image.wrap or wrap, image.pixels.astype(float), np.column_stack([u, v]))


def _aspect(light: ProjectorLight) -> float:
    return 1.0 if light.image is None else float(light.image.pixels.shape[1] / len(light.image.pixels))
