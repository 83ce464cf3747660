"""Scene of the window tests: a red sphere on the left, a gold one on the right, a floor, a light, an environment."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from clrt.scene.lights import PointLight
from clrt.scene.materials.material_types import Diffuse, MetallicRoughness
from clrt.scene.model import Camera, Environment, Mesh, RenderSettings, Scene, Sphere

SKY = (0.2, 0.4, 0.8)


def two_balls(**render: Any) -> Scene:
    """Return the scene at 160 x 120 pixels; the spheres' centers are at (40.4, 60) and (119.6, 60)."""
    red, gold = Diffuse(color=(0.8, 0.1, 0.1)), MetallicRoughness(preset="gold", roughness=0.5)
    floor = Mesh(
        [[-50, 0, -50], [-50, 0, 50], [50, 0, 50], [50, 0, -50]],  # type: ignore
        [[0, 1, 2], [0, 2, 3]],  # type: ignore
        Diffuse(),
        name="floor",
    )
    spheres = [
        Sphere(center=(-1.2, 1, 0), radius=0.8, material=red, name="left"),
        Sphere(center=(1.2, 1, 0), radius=0.8, material=gold, name="right"),
    ]
    settings = RenderSettings(size=(160, 120), spp=4, max_depth=4, integrator="local")
    return Scene(
        meshes=[floor],
        spheres=spheres,
        materials={"red": red, "gold": gold, "floor": floor.material},
        lights=[PointLight(position=(0, 5, 3), intensity=(60, 60, 60))],
        camera=Camera(position=(0, 1, 5), look_at=(0, 1, 0), fov_degrees=40),
        environment=Environment(color=SKY),
        render=replace(settings, **render),
        name="two balls",
    )
