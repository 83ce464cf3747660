"""M1: the same scene rendered with the same seed on every device."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ....scene.materials.material_types import Diffuse, MetallicRoughness, Mirror
from ....scene.model import Camera, Environment, Mesh, RenderSettings, Scene, Sphere
from ...rays.workloads import bumpy_ball
from ..row import Row
from .subject import Subject

#: Relative tolerance of a pixel; pixels with a path that took a different branch differ by more.
ROUNDING = 1e-4


def measure_devices(devices: list[int], *, quick: bool) -> Iterator[Row]:
    """Compare every further device with the first: pixels that differ, and the relative difference of the mean."""
    scene = everything((48, 48) if quick else (256, 256))
    first, *others = (Subject(device).picture(scene, 4 if quick else 16).astype(np.float64) for device in devices)
    for device, picture in zip(devices[1:], others):
        differ = np.abs(picture - first).max(axis=2) > ROUNDING * (first.max(axis=2) + 1e-3)
        yield Row(
            "M1",
            f"device {device} against {devices[0]}: pixels of another path",
            differ.size,
            int(np.count_nonzero(differ)),
            abs(float(picture.mean() / first.mean()) - 1),
            "of the mean",
        )


def everything(size: tuple[int, int]) -> Scene:
    """Return a scene with triangles, spheres and several materials under an environment map with a sun."""
    vertices, faces = bumpy_ball(3)
    sky = np.full((16, 32, 3), 0.5, np.float32)
    sky[4, 5] = 200
    floor = Mesh(
        np.array([[-9, -1.2, -9], [-9, -1.2, 9], [9, -1.2, 9], [9, -1.2, -9]], np.float32),
        np.array([[0, 1, 2], [0, 2, 3]], np.int32),
        Diffuse(color=(0.6, 0.5, 0.4)),
    )
    return Scene(
        meshes=[Mesh(vertices, faces, MetallicRoughness(color=(0.9, 0.4, 0.2), roughness=0.4)), floor],
        spheres=[
            Sphere(center=(2.1, -0.2, 0), material=Mirror()),
            Sphere(center=(-2.1, -0.4, 0.3), radius=0.8, material=Diffuse(emission=(2, 3, 4))),
        ],
        camera=Camera(position=(1.5, 1.2, 6), fov_degrees=45),
        environment=Environment(image=sky),
        render=RenderSettings(size=size, max_depth=6),
    )
