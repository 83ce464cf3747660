"""Spot lights: intensity follows glTF's formula, and selection among many lights is unbiased."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.bench.kernel_probe import Probe
from clrt.bench.significance import mean_test, sidak
from clrt.device.open import Device
from clrt.scene.lights import DirectionalLight, Light, PointLight, SpotLight
from clrt.scene.materials.material_types import Diffuse
from clrt.scene.model import Camera, Environment, RenderSettings, Scene

from .lamps import directions, lamps
from .pictures import film, pixel_means, pixel_points, quad
from .test_light_tree import probabilities
from .test_lights import irradiances, points_and_normals

pytestmark = pytest.mark.statistics

Doubles = NDArray[np.float64]
UP = np.array([0.0, 1.0, 0.0])


def fade(light: SpotLight, points: Doubles) -> Doubles:
    """Return clamp((cos θ − cos outer)/(cos inner − cos outer))², (n,), of KHR_lights_punctual's sample code; for the
    other falloff clamp((outer − θ)/(outer − inner))."""
    away = points - light.position
    cosine = away @ np.array(light.direction) / np.linalg.norm(away, axis=-1) / np.linalg.norm(light.direction)
    if light.falloff == "angle":
        ramp = light.outer_degrees - np.degrees(np.arccos(cosine.clip(-1, 1)))
        return np.asarray(np.clip(ramp / (light.outer_degrees - light.inner_degrees), 0, 1))
    inner, outer = np.cos(np.radians([light.inner_degrees, light.outer_degrees]))
    return np.asarray(np.clip((cosine - outer) / (inner - outer), 0, 1) ** 2)


def spot_irradiance(light: SpotLight, points: Doubles, normal: Doubles = UP) -> Doubles:
    """Return I·fade·cos/d², (n, 3)."""
    d = light.position - points
    cosines = np.maximum(d @ normal, 0) / np.linalg.norm(d, axis=-1) ** 3
    return np.asarray((cosines * fade(light, points))[..., None] * light.intensity)


def spots(count: int, seed: int = 0) -> list[SpotLight]:
    """Return spot lights in the cube [-1, 1]³ with random directions, widths and powers."""
    rng = np.random.default_rng(seed)
    outer, powers = rng.uniform(0.5, 89.0, count), 10.0 ** rng.uniform(-2, 2, count)
    places, axes = rng.uniform(-1, 1, (count, 3)).tolist(), directions(rng, count).tolist()
    return [
        SpotLight(
            position=tuple(place),
            direction=tuple(axis),
            intensity=(power, 0.5 * power, 2.0 * power),
            inner_degrees=width * (i % 3) / 3,
            outer_degrees=width,
        )
        for i, (place, axis, width, power) in enumerate(zip(places, axes, outer.tolist(), powers.tolist()))
    ]


@pytest.mark.parametrize(("inner", "outer"), [(0.0, 45.0), (20.0, 30.0), (29.9999, 30.0), (0.0, 90.0), (0.0, 1e-3)])
@pytest.mark.parametrize("falloff", ["cosine", "angle"])
def test_irradiance(device: Device, inner: float, outer: float, falloff: Literal["cosine", "angle"]) -> None:
    """On the axis, off it by fractions of the outer angle, and outside; near and far. A narrow cone is axis-aligned,
    so that float32 represents the points' angles."""
    light = SpotLight(
        position=(0.0, 0.0, 0.0),
        direction=(3.0, -4.0, 0.0) if outer > 1 else (2.0, 0.0, 0.0),
        intensity=(60.0, 5.0, 1.0),
        inner_degrees=inner,
        outer_degrees=outer,
        falloff=falloff,
    )
    axis, aside = np.array(light.direction) / np.linalg.norm(light.direction), np.array([0.0, 0.0, 1.0])
    parts = np.radians(outer) * np.array([0.0, 0.3, 0.6, 0.9, 0.99, 1.01])
    rays = np.outer(np.cos(parts), axis) + np.outer(np.sin(parts), aside)
    points = np.concatenate([2.0 * rays, 300.0 * rays]).astype(np.float32).astype(np.float64)
    probe = Probe(device, Scene(lights=[light]))
    expected = spot_irradiance(light, points, -axis)
    mean, variance = irradiances(probe, points, -axis)
    assert np.all(variance < 1e-12 * expected.max() ** 2)
    # A steep cone's edge is checked only for its position.
    allowed = 1e-3 if outer < 1 else 1e-6 + 1e-6 / (np.cos(np.radians(inner)) - np.cos(np.radians(outer)))
    assert np.all(np.abs(mean - expected) <= (allowed * 60 / np.sum(points**2, axis=1))[:, None]), (mean, expected)
    assert not mean[[5, 11]].any() and mean[[0, 6]] == pytest.approx(expected[[0, 6]], rel=1e-5)


@pytest.mark.parametrize("unit", [1.0, 1e4])
def test_ranges_end_light(device: Device, unit: float) -> None:
    """I/d²·max(1 − (d/range)⁴, 0), the attenuation recommended by KHR_lights_punctual; together with a light without
    range, at two scene scales. This integrator evaluates every light."""
    reach = 2.0 * unit
    lights: list[PointLight | SpotLight] = [
        PointLight(position=(0.0, 0.0, 0.0), intensity=(3.0, 2.0, 1.0), range=reach),
        SpotLight(position=(0.0, 0.0, 0.0), direction=(0.0, -1.0, 0.0), intensity=(1.0, 2.0, 3.0), range=reach / 2),
        PointLight(position=(0.0, 0.0, 0.0), intensity=(0.1, 0.1, 0.1)),
    ]
    size, heights = 9.0 * unit, np.array([0.3, 0.9, 0.99, 1.2, 1.9, 1.99, 2.1, 8.0]) * unit
    for height in heights.tolist():
        camera = Camera(
            position=(0.0, 0.5 * -height, 0.0), look_at=(0.0, -height, 0.0), up=(0.0, 0.0, 1.0), fov_degrees=0.01
        )
        floor = quad(
            [(-size, -height, size), (size, -height, size), (size, -height, -size), (-size, -height, -size)],
            Diffuse(color=(1.0, 1.0, 1.0)),
        )
        expected = np.zeros(3)
        for light in lights:
            left = 1.0 if light.range is None else max(1 - (height / light.range) ** 4, 0.0)
            expected += np.array(light.intensity) * left / (np.pi * height**2)
        settings = RenderSettings(size=(1, 1), max_depth=2, integrator="local")
        scene = Scene(meshes=[floor], lights=[*lights], camera=camera, render=settings)
        np.testing.assert_allclose(film(device, scene, 4).mean[0, 0], expected, rtol=1e-5)


def test_picture_of_a_spot(device: Device) -> None:
    """A floor in a slanted cone: ρ/pi times the irradiance, pixel by pixel; a lid blocks all of it."""
    light = SpotLight(
        position=(1.0, 3.0, 0.5),
        direction=(-0.3, -1.0, 0.1),
        intensity=(60.0, 50.0, 40.0),
        inner_degrees=10.0,
        outer_degrees=35.0,
    )
    camera, size = Camera(position=(0.0, 6.0, 2.0), fov_degrees=50), (24, 18)
    floor = quad([(-9, 0, 9), (9, 0, 9), (9, 0, -9), (-9, 0, -9)], Diffuse(color=(0.5, 0.5, 0.5)))
    scene = Scene(meshes=[floor], lights=[light], camera=camera, render=RenderSettings(size=size, max_depth=2))
    expected = pixel_means(0.5 / np.pi * spot_irradiance(light, pixel_points(camera, size, 0.0, 8)))
    picture = film(device, scene, 4096, sampler="sobol").mean
    np.testing.assert_allclose(picture, expected, atol=1e-3 * expected.max())
    assert expected.max() > 0.5 and np.sum(expected[..., 0] == 0) > 20
    lid = quad([(0, 2.9, -1), (2, 2.9, -1), (2, 2.9, 2), (0, 2.9, 2)], Diffuse(color=(0.0, 0.0, 0.0)))
    assert not film(device, replace(scene, meshes=[floor, lid]), 4).mean.any()


@pytest.mark.parametrize("count", [1, 9, 32, 400])
def test_irradiance_by_many(device: Device, count: int) -> None:
    """The samples' mean of radiance·cos/pdf is the sum over all lights, with and without a light BVH."""
    lights = spots(count, seed=3)
    probe = Probe(device, Scene(lights=list(lights)))
    p_values = []
    for seed, (point, normal) in enumerate(zip(*points_and_normals(6))):
        out = probe("light_sample", 12, np.tile(np.append(point, normal), (1 << 17, 1)), seed=seed)
        values = out[:, 3:6] * (np.maximum(out[:, :3] @ normal, 0) / out[:, 6])[:, None]
        expected = np.sum([spot_irradiance(light, point, normal) for light in lights], axis=0)
        variance = values.var(axis=0) + len(values) * (1e-4 * expected + 1e-9) ** 2
        p_values.append(mean_test(values.mean(axis=0), variance, len(values), expected))
    assert np.min(p_values) > sidak(1e-3, np.size(p_values))


@pytest.mark.parametrize("count", [20, 500])
def test_cones_tell_which_may_be_chosen(device: Device, count: int) -> None:
    """All spots that reach the point from above its horizon and few others; also mixed with other lights."""
    lights, others = spots(count), lamps(count)
    points, normals = points_and_normals(40)
    spare = Probe(device, Scene(lights=list(lights)))
    mixed = Probe(device, replace(others, lights=[*others.lights, *lights]))
    first = int(mixed.compiled.counts["lights"][0]) - count
    left_out = reached = 0
    for point, normal in zip(points, normals):
        seen = np.array([spot_irradiance(light, point, normal)[0] > 0 for light in lights])
        for probe, start in ((spare, 0), (mixed, first)):
            mass = probabilities(probe, point, normal)
            assert mass.sum() == pytest.approx(1, abs=2e-6)
            # If no light contributes, one of them is drawn nevertheless.
            assert np.all(mass[start:][seen] > 0)
        left_out += int(np.sum(probabilities(spare, point, normal) == 0))
        reached += int(seen.sum())
    assert reached > 0.05 * count * 40 and left_out > 0.8 * (count * 40 - reached)


def test_few_are_chosen_by_what_they_bring(device: Device) -> None:
    """A narrow cone that misses the point leaves the probability to the other lights, of all types."""
    miss = SpotLight(position=(0.0, 2.0, 0.0), direction=(1.0, -0.5, 0.0), intensity=(1e6, 1e6, 1e6), outer_degrees=20)
    hit = replace(miss, direction=(0.0, -1.0, 0.0), intensity=(8.0, 8.0, 8.0))
    lights: list[Light] = [
        PointLight(position=(0.0, 1.0, 0.0), intensity=(2.0, 2.0, 2.0)),
        miss,
        hit,
        DirectionalLight(direction=(0.0, -1.0, 0.0), irradiance=(1.0, 1.0, 1.0)),
    ]
    probe = Probe(device, Scene(lights=lights, environment=Environment(color=(1.0, 1.0, 1.0))))
    brought = np.array([2.0, 0.0, 2.0, 1.0])  # numbered by type: point, spots, directional
    expected = 0.8 * brought / 5 + 0.2 * (brought > 0) / 3
    np.testing.assert_allclose(probabilities(probe, np.zeros(3), UP), expected, rtol=1e-5)
