"""Scenes of any size: the same scene in units in which float32 neither overflows nor loses digits.

A triangle test multiplies three lengths, so edges of 1e-20 or 1e15 leave float32's range though the scene itself does
not. Multiplying all lengths by a power of two changes no digit and no picture.
"""

from __future__ import annotations

from dataclasses import replace
from math import frexp

import numpy as np

from .lights import Light, PointLight
from .model import Mesh, Scene, Sphere, Vector

#: Scenes whose largest coordinate (the camera's aside) lies between 2^-20 and 2^20 are left as they are.
COMFORTABLE = 20


def unit_of(scene: Scene) -> float:
    """The power of two by which lengths should be multiplied: 1 unless the scene is very small or very large."""
    lengths = [float(np.abs(mesh.vertices).max()) for mesh in scene.meshes if mesh.vertices.size]
    lengths += [max(map(abs, sphere.center)) + sphere.radius for sphere in scene.spheres]
    return unit_for(max(lengths, default=0.0))


def unit_for(largest: float) -> float:
    """The power of two that brings a largest coordinate near 1, or 1 where it is comfortable as it is."""
    exponent = frexp(largest)[1]
    return 1.0 if largest == 0 or abs(exponent) <= COMFORTABLE else 2.0**-exponent


def scaled(scene: Scene, unit: float) -> Scene:
    """The scene with all lengths multiplied by `unit`, and point lights such that the picture stays the same."""
    if unit == 1:
        return scene
    camera = replace(scene.camera, position=_times(scene.camera.position, unit),
                     look_at=_times(scene.camera.look_at, unit))
    return replace(scene, meshes=[_mesh(mesh, unit) for mesh in scene.meshes], camera=camera,
                   spheres=[_sphere(sphere, unit) for sphere in scene.spheres],
                   lights=[_light(light, unit) for light in scene.lights])


def _mesh(mesh: Mesh, unit: float) -> Mesh:
    return replace(mesh, vertices=(mesh.vertices * np.float64(unit)).astype(np.float32))


def _sphere(sphere: Sphere, unit: float) -> Sphere:
    return replace(sphere, center=_times(sphere.center, unit), radius=sphere.radius * unit)


def _light(light: Light, unit: float) -> Light:
    if not isinstance(light, PointLight):
        return light
    return replace(light, position=_times(light.position, unit), intensity=_times(light.intensity, unit * unit))


def _times(vector: Vector, factor: float) -> Vector:
    x, y, z = vector
    return x * factor, y * factor, z * factor
