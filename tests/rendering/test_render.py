"""Images with derived results: direct lighting in closed form, furnaces, interreflection as a geometric series."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.bench.significance import mean_test, sidak
from clrt.device.open import Device
from clrt.scene.lights import DirectionalLight, PointLight
from clrt.scene.materials.material_types import Diffuse, Material, MetallicRoughness, Mirror
from clrt.scene.materials.metallic_roughness import Smith
from clrt.scene.model import Camera, Environment, RenderSettings, Scene, Sphere

from ..covering import covering
from .ggx import albedo
from .pictures import box, film, pixel_means, pixel_p_values, pixel_points, quad

Doubles = NDArray[np.float64]
FAMILY = 1e-3
ALBEDO = np.array([0.8, 0.5, 0.2])
PAINT = Diffuse(color=(0.8, 0.5, 0.2))
BLACK = (0.0, 0.0, 0.0)
ABOVE = Camera(position=(0.5, 4.0, 3.0), look_at=(0.0, 0.0, 0.0), fov_degrees=40)
FLOOR = quad([(-50, 0, 50), (50, 0, 50), (50, 0, -50), (-50, 0, -50)], PAINT)


def settings(width: int, height: int, spp: int, max_depth: int = 2) -> RenderSettings:
    return RenderSettings(size=(width, height), spp=spp, max_depth=max_depth, seed=5)


def assert_picture(device: Device, scene: Scene, expected: Doubles) -> None:
    """Assert that every pixel's mean is `expected` within its own noise."""
    picture = film(device, scene)
    everywhere = np.broadcast_to(expected, picture.mean.shape)
    p = pixel_p_values(picture, everywhere)
    assert p.min() > sidak(FAMILY, p.size), (picture.mean.mean(axis=(0, 1)), everywhere.mean(axis=(0, 1)))


def seen_floor(light: Doubles) -> tuple[Doubles, Doubles]:
    """Return squared distance and cosine from the floor's points, in a 12 by 8 image, to a position above."""
    d = light - pixel_points(ABOVE, (12, 8), 0.0)
    distance2 = np.sum(d * d, axis=-1)
    return distance2, d[..., 1] / np.sqrt(distance2)


def test_point_light_on_a_plane(device: Device) -> None:
    """L = albedo/pi · I · cos θ/d²."""
    scene = Scene(
        meshes=[FLOOR],
        lights=[PointLight(position=(1.5, 2.0, -1.0), intensity=(60.0, 58.0, 50.0))],
        camera=ABOVE,
        render=settings(12, 8, 256),
    )
    distance2, cosine = seen_floor(np.array([1.5, 2.0, -1.0]))
    light = (cosine / distance2)[..., None] * ALBEDO / np.pi * [60.0, 58.0, 50.0]
    assert_picture(device, scene, pixel_means(light))


@pytest.mark.parametrize("radius", [0.9, 0.01])
def test_sphere_light_on_a_plane(device: Device, radius: float) -> None:
    """L = albedo · Le · (r/d)² · cos θ, if the sphere is entirely above the horizon."""
    lamp = Sphere(center=(-4.0, 2.0, -1.0), radius=radius, material=Diffuse(color=BLACK, emission=(17.0, 12.0, 4.0)))
    scene = Scene(meshes=[FLOOR], spheres=[lamp], camera=ABOVE, render=settings(12, 8, 1024))
    distance2, cosine = seen_floor(np.array(lamp.center))
    light = (radius**2 * cosine / distance2)[..., None] * ALBEDO * [17.0, 12.0, 4.0]
    assert_picture(device, scene, pixel_means(light))


def test_directional_light_on_a_plane(device: Device) -> None:
    """L = albedo/pi · E · cos θ; a wall casts a hard shadow."""
    wall = quad([(0.0, 0.0, -9.0), (0.0, 0.0, 9.0), (0.0, 9.0, 9.0), (0.0, 9.0, -9.0)], PAINT)
    sun = DirectionalLight(direction=(-3.0, -4.0, 0.0), irradiance=(3.0, 2.0, 1.0))
    camera = Camera(position=(3.0, 4.0, 0.0), look_at=(3.0, 0.0, 0.0), up=(0.0, 0.0, -1.0), fov_degrees=20)
    lit = Scene(meshes=[FLOOR, wall], lights=[sun], camera=camera, render=settings(4, 4, 16))
    picture = film(device, lit).mean
    np.testing.assert_allclose(picture, np.broadcast_to(ALBEDO / np.pi * 0.8 * [3, 2, 1], (4, 4, 3)), rtol=1e-6)
    beyond = Camera(position=(-3.0, 4.0, 0.0), look_at=(-3.0, 0.0, 0.0), up=(0.0, 0.0, -1.0), fov_degrees=20)
    assert not film(device, replace(lit, camera=beyond)).mean.any()


@pytest.mark.parametrize("material", [Diffuse(color=(1.0, 1.0, 1.0)), PAINT, Mirror(color=(0.8, 0.5, 0.2))], ids=str)
def test_furnace(device: Device, material: Material) -> None:
    """A convex body under a white sky has its albedo in every sample, exactly in float32."""
    scene = Scene(
        spheres=[Sphere(material=material)],
        environment=Environment(color=(1.0, 1.0, 1.0)),
        camera=Camera(position=(0.0, 0.0, 3.0), fov_degrees=20),
        render=settings(16, 16, 33, max_depth=8),
    )
    picture = film(device, scene)
    color = np.array(material.parameters()["color"], np.float32)
    assert np.all(picture.mean.astype(np.float32) == color)
    # Squares are rounded to 2^-24 of themselves, which the variance of 33 equal samples cannot distinguish from noise.
    assert picture.noise is not None and picture.noise < np.sqrt(2.0**-24 / 32)


@pytest.mark.parametrize("depth", [1, 2, 3, 40])
def test_emissive_box(device: Device, depth: int) -> None:
    """Closed walls of emission e and albedo a give e·(1 + a + … + a^(d−1)) = e·(1 − a^d)/(1 − a) at depth d.

    The mean over all pixels, whose samples are independent: at depth 40, 0.8^40 = 1e-4 of the whole series is cut off,
    and Russian roulette, which starts after depth four, must not show.
    """
    e = np.array([1.0, 2.0, 0.5])
    walls = box(1.0, Diffuse(color=(0.8, 0.5, 0.2), emission=(1.0, 2.0, 0.5)))
    scene = Scene(
        meshes=[walls],
        camera=Camera(position=(0.1, 0.2, 0.3), look_at=(1.0, 0.5, 0.2), fov_degrees=90),
        render=settings(32, 32, 64, max_depth=depth),
    )
    expected = e * (1 - ALBEDO**depth) / (1 - ALBEDO)
    mean = film(device, scene).mean.reshape(-1, 3)
    p = mean_test(mean.mean(axis=0), mean.var(axis=0), len(mean), expected)
    assert p.min() > sidak(FAMILY, p.size), (mean.mean(axis=0), expected)


@covering("smith, roughness", ["height_correlated", "separable"], [0.3, 0.6])
def test_microfacets_under_a_lamp(device: Device, roughness: float, smith: Smith) -> None:
    """GGX with F = 1 among emissive walls has its single-scattering albedo, with MIS of light and BSDF samples."""
    metal = MetallicRoughness(
        color=(1.0, 1.0, 1.0), metallic=1.0, roughness=roughness, smith=smith, multiple_scattering=False
    )
    tile = quad([(-1, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1)], metal)
    scene = Scene(
        meshes=[box(30.0, Diffuse(color=BLACK, emission=(1.0, 1.0, 1.0))), tile],
        camera=Camera(position=(0.0, 3.0, 4.0), look_at=(0.0, 0.0, 0.0), fov_degrees=0.1),
        render=settings(8, 8, 1024),
    )
    assert_picture(device, scene, np.full(3, albedo(roughness**2, 0.6, smith)))


def test_max_depth_counts_edges(device: Device) -> None:
    """1: emission only; 2: direct light; 3: one bounce, here a mirror that shows the lit floor."""
    lamp = Sphere(center=(0.0, 3.0, 0.0), radius=0.5, material=Diffuse(color=BLACK, emission=(4.0, 4.0, 4.0)))
    mirror = quad([(-5, 0, -2), (5, 0, -2), (5, 5, -2), (-5, 5, -2)], Mirror())
    views = {"lamp": (0.0, 3.0, 0.0), "floor": (0.0, 0.0, 0.0), "floor in the mirror": (0.0, 0.3, -2.0)}
    lit = {}
    for name, target in views.items():
        camera = Camera(position=(0.0, 1.0, 5.0), look_at=target, fov_degrees=1)
        for depth in (1, 2, 3):
            scene = Scene(meshes=[FLOOR, mirror], spheres=[lamp], camera=camera, render=settings(2, 2, 64, depth))
            lit[name, depth] = bool(film(device, scene).mean.any())
    assert [lit["lamp", depth] for depth in (1, 2, 3)] == [True, True, True]
    assert [lit["floor", depth] for depth in (1, 2, 3)] == [False, True, True]
    assert [lit["floor in the mirror", depth] for depth in (1, 2, 3)] == [False, False, True]


@pytest.mark.parametrize("scale", [1e-20, 1e-9, 1e9, 1e15])
def test_size_does_not_matter(device: Device, scale: float) -> None:
    """The emissive box at all scales: e·(1 + a), in pixels that see its walls."""
    walls = box(scale, Diffuse(color=(0.8, 0.5, 0.2), emission=(1.0, 2.0, 0.5)))
    camera = Camera(
        position=(0.1 * scale, 0.2 * scale, 0.3 * scale), look_at=(scale, 0.5 * scale, 0.2 * scale), fov_degrees=90
    )
    scene = Scene(meshes=[walls], camera=camera, render=settings(16, 16, 64))
    assert_picture(device, scene, np.array([1.0, 2.0, 0.5]) * (1 + ALBEDO))


@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1.0, 1e6])
def test_shadows_at_all_sizes(device: Device, scale: float) -> None:
    """A board halfway between a point light and the floor, and one close to the floor: black below both."""
    boards = [
        quad([(x - 1, y, 1), (x + 1, y, 1), (x + 1, y, -1), (x - 1, y, -1)], PAINT) for x, y in ((0, 1), (4, 0.01))
    ]
    meshes = [replace(mesh, vertices=mesh.vertices * np.float32(scale)) for mesh in (FLOOR, *boards)]
    light = PointLight(position=(0.0, 2 * scale, 0.0), intensity=(scale**2, scale**2, scale**2))
    for x in (0.0, 4.0):
        camera = Camera(position=((x + 3) * scale, 0.005 * scale, 0.0), look_at=(x * scale, 0.0, 0.0), fov_degrees=0.01)
        scene = Scene(meshes=meshes, lights=[light], camera=camera, render=settings(4, 4, 16))
        assert not film(device, scene).mean.any(), x
