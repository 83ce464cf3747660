"""Light that comes from no surface: the environment and angular suns, found by escaping rays, and delta lights."""

from __future__ import annotations

import numpy as np

from clrt.scene.lights import DirectionalLight, GoniometricLight, PointLight, ProjectorLight, SpotLight
from clrt.scene.model import Environment, Scene

from .light_images import image_factor
from .textures import bilinear
from .vectors import Doubles, dot, unit

Placed = PointLight | SpotLight | ProjectorLight | GoniometricLight
Known = Placed | DirectionalLight
#: Directional lights below this angular diameter in degrees are delta lights.
POINT = 1e-4


def escaped(scene: Scene, direction: Doubles) -> Doubles:
    """Return the radiance (n, 3) that arrives against unit directions from infinity."""
    radiance = _environment(scene.environment, direction)
    for light in scene.lights:
        if isinstance(light, DirectionalLight) and light.angle_degrees >= POINT:
            half = np.radians(light.angle_degrees) / 2
            within = direction @ -unit(np.array(light.direction, float)) > np.cos(half)
            radiance += within[:, None] * np.array(light.irradiance) / (np.pi * np.sin(half) ** 2)
    return radiance


def delta_lights(scene: Scene) -> list[Known]:
    """Return the lights that only direct summation finds. Raises TypeError for types without a formula here."""
    known: list[Known] = [light for light in scene.lights if isinstance(light, Known)]
    if len(known) < len(scene.lights):
        raise TypeError("the oracle does not know a light's type")
    return [light for light in known if not isinstance(light, DirectionalLight) or light.angle_degrees < POINT]


def arriving(light: Known, p: Doubles) -> tuple[Doubles, Doubles, Doubles]:
    """Return unit directions to a delta light from points (n, 3), distances (n,), and irradiance (n, 3) facing it."""
    if isinstance(light, DirectionalLight):
        towards = np.tile(-unit(np.array(light.direction, float)), (len(p), 1))
        return towards, np.full(len(p), np.inf), np.tile(np.array(light.irradiance, float), (len(p), 1))
    away = np.array(light.position, float) - p
    distance = np.linalg.norm(away, axis=1)
    towards = away / distance[:, None]
    strength = 1 / distance**2
    if light.range is not None:
        strength = strength * np.maximum(1 - (distance / light.range) ** 4, 0)
    return towards, distance, strength[:, None] * _intensity(light, towards)


def _intensity(light: Placed, towards: Doubles) -> Doubles:
    """Return the radiant intensity (n, 3) against unit directions to the light."""
    intensity: Doubles = np.tile(np.array(light.intensity, float), (len(towards), 1))
    if isinstance(light, SpotLight):
        intensity = intensity * _falloff(light, towards)[:, None]
    if isinstance(light, PointLight) or (isinstance(light, SpotLight) and light.image is None):
        return intensity
    return intensity * image_factor(light, -towards)


def _falloff(light: SpotLight, towards: Doubles) -> Doubles:
    """Return KHR_lights_punctual's falloff, the square of a ramp linear in the cosine from the inner to the outer cone;
    or one linear in the angle."""
    inner, outer = np.cos(np.radians([light.inner_degrees, light.outer_degrees]))
    cosine = -dot(towards, unit(np.array(light.direction, float)))
    if light.falloff == "angle":
        ramp = light.outer_degrees - np.degrees(np.arccos(np.clip(cosine, -1, 1)))
        return np.asarray(np.clip(ramp / (light.outer_degrees - light.inner_degrees), 0, 1))
    return np.asarray(np.clip((cosine - outer) / (inner - outer), 0, 1) ** 2)


def _environment(environment: Environment, direction: Doubles) -> Doubles:
    if environment.image is None:
        return np.tile(environment.strength * np.array(environment.color, float), (len(direction), 1))
    # The map rotates counter-clockwise about +Y: directions are rotated back before the look-up.
    angle = np.radians(environment.rotation_degrees)
    x = np.cos(angle) * direction[:, 0] - np.sin(angle) * direction[:, 2]
    z = np.sin(angle) * direction[:, 0] + np.cos(angle) * direction[:, 2]
    image = environment.image.astype(float)
    height, width = image.shape[:2]
    u = np.arctan2(x, -z) / (2 * np.pi) % 1
    v = np.arccos(np.clip(direction[:, 1], -1, 1)) / np.pi
    return environment.strength * bilinear(image, u * width - 0.5, v * height - 0.5, "repeat", "clamp")
