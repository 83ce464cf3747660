"""Scenes with many lights."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from clrt.scene.lights import DirectionalLight, Light, PointLight
from clrt.scene.materials.material_types import Diffuse
from clrt.scene.model import Environment, Mesh, Scene, Sphere

Doubles = NDArray[np.float64]


def directions(rng: np.random.Generator, count: int) -> Doubles:
    w = rng.normal(size=(count, 3))
    return np.asarray(w / np.linalg.norm(w, axis=1, keepdims=True))


def lamps(count: int, seed: int = 0, low: float = -1.0) -> Scene:
    """Return triangles, spheres and point lights, a third each, with powers over four decades, in [-1, 1]³ above
    `low`."""
    rng = np.random.default_rng(seed)
    places = rng.uniform((-1.0, low, -1.0), 1.0, (count, 3))
    powers = 10.0 ** rng.uniform(-2, 2, count)
    meshes, spheres, lights = list[Mesh](), list[Sphere](), list[Light]()
    for i, ((x, y, z), power) in enumerate(zip(places.tolist(), powers.tolist())):
        emission = Diffuse(color=(0.0, 0.0, 0.0), emission=(power, 0.5 * power, 2.0 * power))
        if i % 3 == 0:
            corners = np.array([x, y, z]) + 0.01 * directions(rng, 3)
            meshes.append(Mesh(corners.astype(np.float32), np.array([[0, 1, 2]], np.int32), emission))
        elif i % 3 == 1:
            spheres.append(Sphere(center=(x, y, z), radius=float(rng.uniform(0.001, 0.02)), material=emission))
        else:
            lights.append(PointLight(position=(x, y, z), intensity=(1e-3 * power, 1e-3 * power, 1e-3 * power)))
    return Scene(meshes=meshes, spheres=spheres, lights=lights)


def with_infinite(scene: Scene) -> Scene:
    """Add two distant lights and an environment map to the scene."""
    suns: list[Light] = [DirectionalLight(direction=(x, -1.0, 0.0), irradiance=(0.1, 0.1, 0.1)) for x in (0.0, 2.0)]
    sky = np.random.default_rng(5).random((8, 16, 1)) ** 8 * np.ones(3)
    return replace(scene, lights=[*scene.lights, *suns], environment=Environment(image=sky.astype(np.float32)))


def point_lights(places: Doubles, power: float = 1.0) -> list[Light]:
    return [PointLight(position=(x, y, z), intensity=(power, power, power)) for x, y, z in places.tolist()]
