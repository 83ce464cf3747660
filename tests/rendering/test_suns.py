"""Directional lights with an angular size: irradiance, disc, penumbrae and reflections against float64 quadratures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.bench.kernel_probe import Probe
from clrt.bench.significance import mean_test, sidak
from clrt.device.open import Device
from clrt.scene.lights import DirectionalLight, Light
from clrt.scene.materials.material_types import Diffuse, MetallicRoughness, Mirror
from clrt.scene.model import Camera, Environment, Mesh, RenderSettings, Scene
from clrt.scene.render_settings import Integrator

from .ggx import cook_torrance
from .pictures import film, pixel_means, pixel_points, quad

pytestmark = pytest.mark.statistics

Doubles = NDArray[np.float64]
COUNT, FAMILY = 1 << 16, 1e-3
RED, BLACK = (0.8, 0.5, 0.2), (0.0, 0.0, 0.0)
E = (3.0, 2.0, 1.0)
FLOOR = quad([(-99, 0, 99), (99, 0, 99), (99, 0, -99), (-99, 0, -99)], Diffuse(color=RED))


def unit(v: object) -> Doubles:
    values = np.asarray(v, np.float64)
    return np.asarray(values / np.linalg.norm(values, axis=-1, keepdims=True))


def disc(towards: Doubles, angle_degrees: float, steps: int = 64) -> tuple[Doubles, Doubles]:
    """Return midpoint directions (n, 3) of the disc and the solid angle of each, (n,)."""
    axes = np.linalg.svd(towards[None])[2]
    height = 2 * np.sin(np.radians(angle_degrees) / 4) ** 2
    h = height * (np.arange(steps) + 0.5)[:, None] / steps
    phi = 2 * np.pi * (np.arange(steps) + 0.5) / steps
    sine = np.sqrt(h * (2 - h))
    across = sine[..., None] * (np.cos(phi)[:, None] * axes[1] + np.sin(phi)[:, None] * axes[2])
    wi = (1 - h)[..., None] * towards + across
    return wi.reshape(-1, 3), np.full(steps * steps, 2 * np.pi * height / steps**2)


def sun(direction: object, angle: float, irradiance: tuple[float, float, float] = E) -> DirectionalLight:
    x, y, z = np.asarray(direction, np.float64).tolist()
    return DirectionalLight(direction=(x, y, z), irradiance=irradiance, angle_degrees=angle)


@pytest.mark.parametrize("tilt", [0.0, 50.0, 89.0, 93.0])
@pytest.mark.parametrize("angle", [1e-3, 0.53, 20.0, 180.0])
def test_irradiance(device: Device, angle: float, tilt: float) -> None:
    """A surface facing the sun receives its irradiance; a tilted one that of a quadrature above its horizon."""
    normal = np.array([0.0, np.cos(np.radians(tilt)), np.sin(np.radians(tilt))])
    towards = np.array([0.0, 1.0, 0.0])
    probe = Probe(device, Scene(lights=[sun(-towards, angle)]))
    out = probe("light_sample", 12, np.zeros((COUNT, 3)), np.tile(normal, (COUNT, 1)), seed=3)
    brought = out[:, 3:6] * (np.maximum(out[:, :3] @ normal, 0) / out[:, 6])[:, None]
    wi, solid_angle = disc(towards, angle, 2048)
    seen = np.sum(np.maximum(wi @ normal, 0) * solid_angle)
    expected = seen / (np.pi * np.sin(np.radians(angle) / 2) ** 2) * np.array(E)
    if tilt == 0:
        np.testing.assert_allclose(expected, E, rtol=1e-6)
    p = mean_test(brought.mean(axis=0), brought.var(axis=0) + COUNT * (1e-5 * expected) ** 2, COUNT, expected)
    assert p.min() > sidak(FAMILY, 16 * p.size), (brought.mean(axis=0), expected)


def test_what_is_sampled_is_what_is_seen(device: Device) -> None:
    """Several overlapping discs: each sample's direction is inside its disc; the radiance there is that of all discs
    around it, each weighted by the power heuristic against its light sampling pdf."""
    lights = [
        sun((0.3, -1.0, 0.1), 20.0),
        sun((0.2, -1.0, 0.2), 15.0, (1.0, 7.0, 2.0)),
        sun((0.4, -1.0, 0.0), 0.53, (5.0, 1.0, 1.0)),
        sun((-1.0, -1.0, 0.0), 1e-3, (1.0, 1.0, 9.0)),
    ]
    towards = -unit([light.direction for light in lights])
    radiance = np.array([light.radiance for light in lights])
    probe = Probe(device, Scene(lights=list[Light](lights), environment=Environment(color=(0.1, 0.2, 0.3))))
    normal = np.tile(unit([0.2, 1.0, -0.1]), (COUNT, 1))
    out = probe("light_sample", 12, np.zeros((COUNT, 3)), normal, seed=5)
    own = np.argmin(np.abs(out[:, None, 3:6] / radiance - 1).max(axis=-1), axis=1)
    np.testing.assert_allclose(out[:, 3:6], radiance[own], rtol=1e-6)
    cosines, half = out[:, :3] @ towards.T, np.radians([light.angle_degrees for light in lights]) / 2
    angles = np.linalg.norm(out[:, None, :3] - towards, axis=-1)  # as precise for small angles as the arcs
    margin = 2e-7 / half
    inside = angles < 2 * np.sin(half / 2)
    assert np.all((angles <= 2 * np.sin(half / 2) * (1 + margin))[np.arange(COUNT), own]), cosines.min()
    densities = np.array([np.mean(out[own == i, 6]) for i in range(4)])  # each light's: probability over solid angle
    sure = np.all(np.abs(angles / (2 * np.sin(half / 2)) - 1) > margin, axis=1)
    assert sure.mean() > 0.95
    found = np.random.default_rng(1).uniform(0.1, 3, COUNT) * out[:, 6]
    seen = probe("environment", 6, np.zeros((COUNT, 3)), normal, out[:, :3], found)
    sky = np.array([0.1, 0.2, 0.3])
    np.testing.assert_allclose(seen[sure, :3], (inside @ radiance + sky)[sure], rtol=1e-5)
    weights = found[:, None] ** 2 / (found[:, None] ** 2 + densities**2)
    np.testing.assert_allclose(seen[sure, 3:], ((inside * weights) @ radiance + sky)[sure], rtol=1e-4)


@pytest.mark.parametrize("integrator", ["path", "local"])
@pytest.mark.parametrize("mirrored", [False, True], ids=["seen", "in a mirror"])
@pytest.mark.parametrize("angle", [1e-3, 0.53, 30.0])
def test_disc(device: Device, angle: float, mirrored: bool, integrator: Integrator) -> None:
    """A view twice as wide as the sun is filled to pi/16 by a disc of irradiance/(pi sin²(angle/2))."""
    light, fov = sun((0.3, -1.0, 0.2), angle), 2 * np.degrees(np.arctan(2 * np.tan(np.radians(angle) / 2)))
    direction = unit(light.direction) * ([1, -1, 1] if mirrored else [-1, -1, -1])
    if mirrored:
        direction[[0, 2]] *= -1
        direction[1] = -abs(direction[1])
    mirror = Mesh(FLOOR.vertices, FLOOR.faces, Mirror(color=(0.5, 0.5, 0.5)))
    x, y, z = direction.tolist()
    camera = Camera(position=(0.0, 1.0, 0.0), look_at=(x, 1 + y, z), up=(1.0, 0.0, 0.0), fov_degrees=fov)
    scene = Scene(
        meshes=[mirror],
        lights=[light],
        camera=camera,
        render=RenderSettings(size=(32, 32), spp=256, max_depth=2, integrator=integrator),
    )
    pixels = film(device, scene).mean
    expected = np.array(light.radiance) * np.pi / 16 * (0.5 if mirrored else 1)
    # Rays of a float32 camera lie on a grid, which is coarse for the smallest disc.
    rounding = 6e-8 / np.radians(angle)
    share, samples = np.pi / 16, 32 * 32 * 256
    variance = expected**2 * ((1 - share) / share + samples * rounding**2)
    p = mean_test(pixels.mean(axis=(0, 1)), variance, samples, expected)
    assert p.min() > sidak(FAMILY, 3 * 12), (pixels.mean(axis=(0, 1)), expected)
    np.testing.assert_allclose(pixels[16, 16], np.array(light.radiance) * (0.5 if mirrored else 1), rtol=1e-5)
    assert not pixels[0].any()


@pytest.mark.parametrize("integrator", ["path", "local", "raster"])
def test_penumbra(device: Device, integrator: Integrator) -> None:
    """Behind a wall the floor is lit by the part of the disc above the edge: `color`/pi times
    that, without ambient light.
    """
    light = sun((-3.0, -4.0, 0.0), 12.0)
    wall = quad([(0.0, 0.0, -99.0), (0.0, 0.0, 99.0), (0.0, 4.0, 99.0), (0.0, 4.0, -99.0)], Diffuse(color=BLACK))
    camera = Camera(position=(-3.0, 9.0, 0.0), look_at=(-3.0, 0.0, 0.0), up=(0.0, 0.0, -1.0), fov_degrees=3.0)
    scene = Scene(
        meshes=[FLOOR, wall],
        lights=[light],
        camera=camera,
        render=RenderSettings(size=(32, 4), spp=256, max_depth=2, integrator=integrator),
    )
    wi, solid_angle = disc(-unit(light.direction), 12.0, 256)
    points = pixel_points(camera, scene.render.size, 0.0)[0, :, :, 0]
    # A direction clears the edge if its slope is more than 4 over the distance to the wall.
    slopes = wi[:, 1] / wi[:, 0]
    order = np.argsort(slopes)
    brought = np.append(np.cumsum((wi[:, 1] * solid_angle)[order][::-1])[::-1], 0)
    received = brought[np.searchsorted(slopes[order], 4 / -points)]
    shaded = received[..., None] * np.array(light.radiance) * RED / np.pi
    expected, lit = pixel_means(shaded[None])[0], shaded.max(axis=(0, 1))
    assert np.count_nonzero((expected > 0.02 * lit) & (expected < 0.98 * lit)) > 24
    # Samples are between 0 and `lit`, except for the cosines within the disc.
    variance = (1.01 * lit - expected) * expected + 1e-12
    p = mean_test(film(device, scene).mean.mean(axis=0), variance, 4 * scene.render.spp, expected)
    assert p.min() > sidak(FAMILY, 3 * p.size)


@pytest.mark.parametrize("roughness", [0.02, 0.05, 0.1, 0.2, 0.5])
def test_reflection_of_rough_metal(device: Device, roughness: float) -> None:
    """Near the mirror direction of the sun, a flat metal has the quadrature of its BSDF over the disc."""
    metal = MetallicRoughness(color=(1.0, 1.0, 1.0), metallic=1.0, roughness=roughness, multiple_scattering=False)
    light = sun((-0.6, -0.8, 0.0), 0.53)
    towards = -unit(light.direction)
    wi, solid_angle = disc(towards, 0.53, 1024)
    turned = [0, 2, 1]  # to a frame whose z is the floor's normal
    for off in (0.0, 0.2, 1.0):
        a = np.arctan2(0.6, 0.8) + np.radians(off)
        wo = np.array([-np.sin(a), np.cos(a), 0.0])
        x, y, _ = (10 * wo).tolist()
        camera = Camera(position=(x, y, 0.0), projection="orthographic", view_height=1.0)
        scene = Scene(
            meshes=[replace(FLOOR, material=metal)],
            lights=[light],
            camera=camera,
            render=RenderSettings(size=(32, 32), spp=128, max_depth=2),
        )
        value = cook_torrance(metal, np.broadcast_to(wo, wi.shape)[:, turned], wi[:, turned])
        expected = np.sum(value * (wi[:, 1] * solid_angle)[:, None], axis=0) * light.radiance
        pixels = film(device, scene).mean.reshape(-1, 3)
        p = mean_test(
            pixels.mean(axis=0),
            pixels.var(axis=0, ddof=1) + len(pixels) * (1e-4 * expected) ** 2,
            len(pixels),
            expected,
        )
        assert p.min() > sidak(FAMILY, 15 * 3), (off, pixels.mean(axis=0), expected)


def test_smooth_metal_has_little_noise(device: Device) -> None:
    """With MIS, the noise of a near mirror's highlight is at most a few times that of a rough one."""
    noise = {}
    for roughness in (0.02, 0.2):
        metal = MetallicRoughness(color=(1.0, 1.0, 1.0), metallic=1.0, roughness=roughness)
        camera = Camera(position=(-6.0, 8.0, 0.0), projection="orthographic", view_height=1.0)
        scene = Scene(
            meshes=[replace(FLOOR, material=metal)],
            lights=[sun((-0.6, -0.8, 0.0), 0.53)],
            camera=camera,
            render=RenderSettings(size=(32, 32), spp=64, max_depth=2),
        )
        pixels = film(device, scene).mean
        noise[roughness] = pixels[..., 0].std() / pixels[..., 0].mean()
    assert noise[0.02] < 0.1 and noise[0.2] < 0.1, noise


def test_a_point_compiles_no_disc(device: Device) -> None:
    features = [Probe(device, Scene(lights=[sun((0.0, -1.0, 0.0), angle)])).compiled.features for angle in (0.0, 0.53)]
    assert ("LIGHT_SUN" in features[0], "LIGHT_SUN" in features[1]) == (False, True)
