"""What lies somewhere in the world lies where float64 says in the picture."""

from __future__ import annotations

import numpy as np
import pytest

from clrt.device.open import Device
from clrt.scene.materials import Diffuse
from clrt.scene.model import Camera, Environment, RenderSettings, Scene, Sphere

from .pictures import film, frame
from .skies import lookup

CAMERAS = {
    "plain": Camera(position=(0.0, 0.0, 5.0), look_at=(0.0, 0.0, 0.0), fov_degrees=40),
    "wide": Camera(position=(1.0, 2.0, 3.0), look_at=(4.0, 2.5, -3.0), fov_degrees=110),
    "down": Camera(position=(0.0, 8.0, 0.0), look_at=(0.0, 0.0, 0.0), up=(0.0, 0.0, -1.0), fov_degrees=20),
    "rolled": Camera(position=(-3.0, 1.0, 2.0), look_at=(0.0, 0.0, 0.0), up=(1.0, 2.0, -0.3), fov_degrees=60),
    "far": Camera(position=(1e5, 0.0, 0.0), look_at=(1e5, 0.0, -1.0), fov_degrees=40),
}


@pytest.mark.parametrize("name", CAMERAS)
@pytest.mark.parametrize("size", [(40, 30), (21, 55)], ids=str)
def test_spheres_lie_where_they_are_seen(device: Device, name: str, size: tuple[int, int]) -> None:
    """Eight glowing spheres, smaller than a pixel, in the middles of pixels; the ratio of red and green says which."""
    camera, (width, height) = CAMERAS[name], size
    forward, right, up, extent = frame(camera)
    rng = np.random.default_rng(1)
    pixels = rng.permutation(width * height)[:8]
    columns, rows = pixels % width, pixels // width
    depth = rng.uniform(5, 50, 8)
    x = (2 * (columns + 0.5) / width - 1) * extent * width / height
    y = (1 - 2 * (rows + 0.5) / height) * extent
    centers = camera.position + depth[:, None] * (forward + x[:, None] * right + y[:, None] * up)
    radius = 0.15 * depth * 2 * extent / height
    spheres = [Sphere(center=tuple(center), radius=float(r), material=Diffuse(emission=(1.0, float(i + 1), 0.0)))
               for i, (center, r) in enumerate(zip(centers.tolist(), radius))]
    scene = Scene(spheres=spheres, camera=camera, render=RenderSettings(size=size, spp=256, max_depth=1))
    picture = film(device, scene).mean
    assert sorted(np.flatnonzero(picture[..., 0])) == sorted(pixels)
    np.testing.assert_allclose(picture[rows, columns, 1] / picture[rows, columns, 0], np.arange(1, 9), rtol=1e-6)


def test_right_is_cross_of_forward_and_up(device: Device) -> None:
    """Looking along −Z with +Y up, +X is on the right and +Y on top; the sky's seam is in the middle."""
    image = np.random.default_rng(3).random((4, 8, 3)).astype(np.float32)
    for target in ((0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (0.3, 0.9, 0.2)):
        looking = Camera(position=(0.0, 0.0, 0.0), look_at=target, fov_degrees=1e-3)
        scene = Scene(environment=Environment(image=image), camera=looking, render=RenderSettings(size=(2, 2), spp=4))
        direction = np.array([target]) / np.linalg.norm(target)
        np.testing.assert_allclose(film(device, scene).mean, np.tile(lookup(image, direction), (2, 2, 1)), atol=1e-4)
    wide = Camera(position=(0.0, 0.0, 0.0), look_at=(0.0, 0.0, -1.0), fov_degrees=90)
    marks = [Sphere(center=(3.0, 0.0, -5.0), radius=0.5, material=Diffuse(emission=(1.0, 0.0, 0.0))),
             Sphere(center=(0.0, 3.0, -5.0), radius=0.5, material=Diffuse(emission=(0.0, 1.0, 0.0)))]
    settings = RenderSettings(size=(9, 9), spp=16, max_depth=1)
    picture = film(device, Scene(spheres=marks, camera=wide, render=settings)).mean
    assert picture[..., 0].argmax() == 4 * 9 + 7
    assert picture[..., 1].argmax() == 1 * 9 + 4
