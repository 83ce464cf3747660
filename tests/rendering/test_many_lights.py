"""Lighting by many lights with one chosen per sample: closed forms, and images that add up."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.bench.kernel_probe import Probe
from clrt.bench.significance import mean_test, sidak
from clrt.device.open import Device
from clrt.scene.lights import PointLight
from clrt.scene.materials.material_types import Diffuse
from clrt.scene.model import Camera, RenderSettings, Scene

from .lamps import lamps, with_infinite
from .pictures import film, quad
from .test_lights import points_and_normals

pytestmark = pytest.mark.statistics

Doubles = NDArray[np.float64]
FAMILY = 1e-3
UP = np.array([0.0, 1.0, 0.0])


def triangle_irradiance(corners: Doubles) -> float:
    """Return ∫ cos θ dω at the origin, facing +Y, over a triangle above the horizon (Lambert 1760), 0 from its back."""
    w = corners / np.linalg.norm(corners, axis=1, keepdims=True)
    total = 0.0
    for a, b in zip(w, np.roll(w, -1, axis=0)):
        cross = np.cross(a, b)
        total -= np.arctan2(np.linalg.norm(cross), a @ b) * cross[1] / np.linalg.norm(cross)
    return max(total / 2, 0.0)


def light_irradiance(scene: Scene, point: Doubles) -> Doubles:
    """Return the irradiance (3,) on a plane that faces up, from all lights, each entirely above it and unoccluded."""
    total = np.zeros(3)
    for mesh in scene.meshes:
        for face in mesh.vertices[mesh.faces].astype(np.float64):
            total += np.array(mesh.material.emission) * triangle_irradiance(face - point)
    for sphere in scene.spheres:
        d = np.array(sphere.center) - point
        total += np.pi * np.array(sphere.material.emission) * sphere.radius**2 * d[1] / np.linalg.norm(d) ** 3
    for light in scene.lights:
        assert isinstance(light, PointLight)
        d = np.array(light.position) - point
        total += np.array(light.intensity) * d[1] / np.linalg.norm(d) ** 3
    return total


@pytest.mark.parametrize("count", [9, 400])
def test_irradiance_by_many_lights(device: Device, count: int) -> None:
    """The samples' mean of radiance·cos/pdf is the sum of the closed forms of all lights."""
    scene = lamps(count, seed=4, low=0.05)
    probe = Probe(device, scene)
    p_values = []
    for seed, (x, z) in enumerate(np.random.default_rng(6).uniform(-1, 1, (4, 2))):
        point = np.array([x, 0.0, z]).astype(np.float32).astype(np.float64)
        out = probe("light_sample", 12, np.tile(np.append(point, UP), (1 << 18, 1)), seed=seed)
        values = out[:, 3:6] * (np.maximum(out[:, 1], 0) / out[:, 6])[:, None]
        expected = light_irradiance(scene, point)
        variance = values.var(axis=0) + len(values) * (1e-5 * expected) ** 2
        p_values.append(mean_test(values.mean(axis=0), variance, len(values), expected))
    assert np.min(p_values) > sidak(FAMILY, np.size(p_values))


@pytest.mark.parametrize("scene", [lamps(10), lamps(200), with_infinite(lamps(100))], ids=["few", "many", "infinite"])
def test_a_met_lamp_has_the_density_of_its_samples(device: Device, scene: Scene) -> None:
    """A ray along a sample's direction hits its emitter or one in front; if it is the same, both densities agree."""
    probe = Probe(device, scene)
    points, normals = points_and_normals(1 << 14)
    sample = probe("light_sample", 12, points, normals, seed=1)
    met = probe("emitter", 5, points, normals, sample[:, :3])
    same = (met[:, 4] >= 0) & np.all(met[:, :3] == sample[:, 3:6], axis=1) & sample[:, 3:6].any(axis=1)
    same &= sample[:, 10] == 0
    assert np.mean(same) > 0.1
    np.testing.assert_allclose(met[same, 3], sample[same, 6], rtol=2e-3)  # less precise near a sphere's edge


def test_a_met_sky_has_the_density_of_its_samples(device: Device) -> None:
    probe = Probe(device, with_infinite(lamps(100)))
    points, normals = points_and_normals(1 << 16)
    sample = probe("light_sample", 12, points, normals, seed=1)
    sky = (sample[:, 10] == 1) & (sample[:, 11] == 0)
    met = probe("sky", 4, points[sky], normals[sky], sample[sky, :3])
    assert np.mean(sky) > 0.01
    # Except for directions at a texel's edge, which are rounded to the other side.
    assert np.mean(np.abs(met[:, 3] / sample[sky, 6] - 1) < 1e-4) > 0.999


def test_pictures_of_parts_add_up(device: Device) -> None:
    """The image of a floor under 90 lights with a light BVH equals the sum of images with subsets of them."""
    scene = lamps(90, seed=8, low=0.1)
    floor = quad([(-1, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1)], Diffuse(color=(0.5, 0.5, 0.5)))
    scene = replace(
        scene,
        meshes=[floor, *scene.meshes],
        camera=Camera(position=(0.0, 0.5, 3.0), fov_degrees=30),
        render=RenderSettings(size=(32, 24), max_depth=2, spp=512, sampler="independent"),
    )
    black = Diffuse(color=(0.0, 0.0, 0.0))
    dark_meshes = [floor, *(replace(mesh, material=black) for mesh in scene.meshes[1:])]
    dark_spheres = [replace(sphere, material=black) for sphere in scene.spheres]
    parts = replace(scene, spheres=dark_spheres, lights=[]), replace(scene, meshes=dark_meshes)
    (whole, variance), *others = (picture_mean(device, each) for each in (scene, *parts))
    total, variances = np.sum(others, axis=0)
    p_values = mean_test(whole, variance + variances, 1, total)
    assert p_values.min() > sidak(FAMILY, 3), (whole, total)


def picture_mean(device: Device, scene: Scene) -> tuple[Doubles, Doubles]:
    """Return the mean over an image of independent samples and its variance, (3,) each."""
    pixels, count = film(device, scene).pixels.ravel(), scene.render.spp
    sums, squares = (pixels[name].astype(np.float64) + pixels[f"{name}_error"] for name in ("sum", "square"))
    mean = sums / count
    return mean.mean(axis=0), np.sum(squares / count - mean**2, axis=0) / (count - 1) / len(pixels) ** 2
