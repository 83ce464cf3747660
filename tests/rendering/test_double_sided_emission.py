"""Emission from one or both sides of a surface, in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clrt.bench.kernel_probe import Probe
from clrt.bench.significance import mean_test, sidak
from clrt.device.open import Device
from clrt.rendering.film.film import Film
from clrt.scene.materials.material_types import Diffuse
from clrt.scene.model import Camera, Mesh, RenderSettings, Scene, Sphere
from clrt.scene.render_settings import Integrator

from . import rays
from .lamps import directions
from .pictures import film, quad
from .test_lights import (
    COUNT,
    FAMILY,
    LAMP,
    POINTS,
    RADIANCE,
    assert_mean,
    irradiances,
    rectangle,
    rectangle_irradiance,
)

pytestmark = pytest.mark.statistics

BOTH = replace(LAMP, double_sided=True)
SIDE = (-1.0, 0.7, -0.4, 1.5)
BLACK = (0.0, 0.0, 0.0)


@pytest.mark.parametrize("turned", [False, True], ids=["front", "back"])
def test_a_double_sided_rectangle_lights_both_sides_alike(device: Device, turned: bool) -> None:
    """Each side emits like the front of a one-sided one."""
    lamp = replace(rectangle(*SIDE, 2.0), material=BOTH)
    lamp.faces = lamp.faces[:, ::-1].copy() if turned else lamp.faces
    assert_mean(Probe(device, Scene(meshes=[lamp])), POINTS, rectangle_irradiance(*SIDE, 2.0, POINTS))


def test_many_double_sided_lights_are_twice_as_many_one_sided_ones(device: Device) -> None:
    """Through the light BVH, at points and normals anywhere among the lights."""
    rng = np.random.default_rng(8)
    corners = rng.uniform(-1, 1, (60, 1, 3)) + 0.1 * directions(rng, 180).reshape(60, 3, 3)
    faces = np.arange(180, dtype=np.int32).reshape(60, 3)
    vertices = corners.reshape(-1, 3).astype(np.float32)
    double = Probe(device, Scene(meshes=[Mesh(vertices, faces, BOTH)]))
    single = Probe(device, Scene(meshes=[Mesh(vertices, turned, LAMP) for turned in (faces, faces[:, ::-1].copy())]))
    assert "LIGHT_TREE" in double.compiled.features
    assert 2 * double.compiled.counts["lights"][0] == single.compiled.counts["lights"][0] == 120
    for point, normal in zip(rng.uniform(-0.8, 0.8, (4, 1, 3)), directions(rng, 4)):
        (mean, variance), (expected, uncertain) = (irradiances(probe, point, normal) for probe in (double, single))
        p = mean_test(mean, variance + uncertain, COUNT, expected)
        assert expected.min() > 0 and p.min() > sidak(FAMILY, 4 * p.size), (mean, expected)


@pytest.mark.parametrize("integrator", ["path", "direct", "local", "raster"])
@pytest.mark.parametrize("double_sided", [False, True])
def test_a_lamp_seen_from_behind(device: Device, integrator: Integrator, double_sided: bool) -> None:
    """A camera sees the back of an emitter: its radiance exactly if double-sided, otherwise nothing."""
    lamp = replace(rectangle(-1, 1, -1, 1, 0.0), material=replace(LAMP, color=BLACK, double_sided=double_sided))
    scene = Scene(
        meshes=[lamp],
        camera=Camera(position=(0, 5, 0), look_at=(0, 0, 0), up=(0, 0, 1), fov_degrees=5),
        render=RenderSettings(size=(8, 8), spp=2, integrator=integrator),
    )
    np.testing.assert_array_equal(film(device, scene).mean, np.broadcast_to(RADIANCE * double_sided, (8, 8, 3)))


@pytest.mark.parametrize("as_mesh", [False, True], ids=["sphere", "mesh"])
def test_a_furnace_of_the_inner_side(device: Device, as_mesh: bool) -> None:
    """A convex body reflects its albedo times the uniform radiance of its surroundings."""
    shell = Diffuse(color=BLACK, emission=(0.5, 1.0, 2.0), double_sided=True)
    vertices, faces = rays.icosphere(1)
    scene = Scene(
        meshes=[Mesh(3 * vertices, faces, shell)] if as_mesh else [],
        spheres=[Sphere(radius=0.5, material=Diffuse(color=(0.8, 0.4, 0.2)))]
        + ([] if as_mesh else [Sphere(radius=3.0, material=shell)]),
        camera=Camera(position=(0, 0, 2), fov_degrees=10),
        render=RenderSettings(size=(8, 8), spp=256, max_depth=2),
    )
    found = film(device, scene)
    samples, mean = found.samples, found.mean.mean(axis=(0, 1))
    variance = found.variance.mean(axis=(0, 1)) * 256 + samples * (1e-6 * 0.4) ** 2  # including rounding
    assert mean_test(mean, variance, samples, 0.4).min() > sidak(FAMILY, 3), mean


def test_an_inner_side_seen_through_a_transparent_near_side_lights_all_the_same(device: Device) -> None:
    """For a sphere of opacity a a ray sees L·a on the near side, and (1 − a)·L·a on the far side's inside."""

    def lit(opacity: float) -> Film:
        ball = Sphere(
            center=(0, 1.5, 0), material=Diffuse(color=BLACK, emission=(1, 1, 1), opacity=opacity, double_sided=True)
        )
        return film(
            device,
            Scene(
                meshes=[ground],
                spheres=[ball],
                render=render,
                camera=Camera(position=(0, 0.3, 3), look_at=(0, 0, 1.5), fov_degrees=5),
            ),
        )

    ground = quad([(-2, 0, 2), (2, 0, 2), (2, 0, -2), (-2, 0, -2)], Diffuse())
    render = RenderSettings(size=(8, 8), spp=1024, max_depth=2)
    solid, half = lit(1.0).mean[..., 0].mean(), lit(0.5)
    error = np.sqrt(half.variance[..., 0].sum()) / 64
    assert abs(half.mean[..., 0].mean() - 0.75 * solid) < 5 * error < 0.05 * solid


def test_code_for_both_sides_is_compiled_where_a_light_has_them(device: Device) -> None:
    def features(material: Diffuse) -> list[str]:
        return Probe(device, Scene(meshes=[replace(rectangle(*SIDE, 2.0), material=material)])).compiled.features

    assert "DOUBLE_SIDED_LIGHTS" in features(BOTH)
    assert "DOUBLE_SIDED_LIGHTS" not in features(LAMP)
    assert "DOUBLE_SIDED_LIGHTS" not in features(Diffuse(double_sided=True))
