"""The local integrator and the Phong models: textbook formulas in float64, shadows, mirrors and their depth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clrt.bench.kernel_probe import Doubles
from clrt.bench.numerics.bsdf_cases import bsdfs
from clrt.bench.numerics.scattering import above
from clrt.bench.significance import sidak
from clrt.device.open import Device
from clrt.rendering.compile.choices import Choices
from clrt.rendering.compile.compile_scene import compile_scene
from clrt.scene.lights import DirectionalLight, Light, PointLight
from clrt.scene.materials.material_types import BlinnPhong, Dielectric, Diffuse, Material, Mirror, Phong
from clrt.scene.model import Camera, Environment, Mesh, RenderSettings, Scene, Sphere

from ..covering import others
from .pictures import film, pixel_means, pixel_p_values, pixel_points, quad

RED, GLOSS = (0.7, 0.3, 0.2), (0.5, 0.5, 0.4)
SKY = (0.1, 0.2, 0.3)
EYE = (0.0, 2.0, 3.0)
SETTINGS = RenderSettings(size=(24, 16), spp=256, max_depth=8, integrator="local")
POINTS: list[Light] = [
    PointLight(position=(1.0, 1.5, -1.0), intensity=(5.0, 4.0, 3.0)),
    PointLight(position=(-1.0, 0.7, 0.5), intensity=(1.0, 2.0, 1.0)),
]


def ground(material: Material, height: float = 0.0, half: float = 50.0) -> Mesh:
    return quad([(-half, height, half), (half, height, half), (half, height, -half), (-half, height, -half)], material)


def glossy(material: Phong, wo: Doubles, wi: Doubles) -> Doubles:
    """Return cos^n of the two models (n,), for directions (n, 3) given with the normal's axis last."""
    if isinstance(material, BlinnPhong):
        half = (wo + wi) / np.linalg.norm(wo + wi, axis=-1, keepdims=True)
        return np.asarray(half[..., 2] ** material.shininess)
    mirrored = wo * [-1, -1, 1]
    return np.asarray(np.maximum(np.sum(mirrored * wi, axis=-1), 0) ** material.shininess)


@pytest.mark.parametrize("kind", [BlinnPhong, *others(Phong)])
def test_points_light_a_plane_as_the_books_say(device: Device, kind: type[Phong]) -> None:
    """ambient·color·sky + Σ I/(pi·d²)·(color·cos + specular·cos^n), where pi cancels."""
    material = kind(color=RED, specular=GLOSS, shininess=20.0, ambient=0.6)
    camera = Camera(position=EYE, fov_degrees=30)
    scene = Scene(
        meshes=[ground(material)], lights=POINTS, camera=camera, environment=Environment(color=SKY), render=SETTINGS
    )
    p = pixel_points(camera, SETTINGS.size, 0.0)
    turned = [0, 2, 1]  # the normal's axis last

    def unit(v: Doubles) -> Doubles:
        return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))

    wo = unit(np.array(EYE) - p)[..., turned]
    expected = np.broadcast_to(0.6 * np.multiply(RED, SKY), p.shape).copy()
    for light in POINTS:
        assert isinstance(light, PointLight)
        d = np.array(light.position) - p
        wi = unit(d)[..., turned]
        shaded = wi[..., 2:] * RED + glossy(material, wo, wi)[..., None] * GLOSS
        expected += shaded * np.array(light.intensity) / np.pi / np.sum(d * d, axis=-1, keepdims=True)
    assert pixel_p_values(film(device, scene, spp=64), pixel_means(expected)).min() > sidak(1e-4, 24 * 16 * 3)


@pytest.mark.parametrize(
    "kind, norm",
    [
        (Phong, lambda n: (n + 2) / (2 * np.pi)),
        (BlinnPhong, lambda n: (n + 2) * (n + 4) / (8 * np.pi * (2 ** (-n / 2) + n))),
    ],
)
@pytest.mark.parametrize("n", [0.0, 5.0, 300.0])
def test_on_paths_they_are_normalised(device: Device, kind: type[Phong], norm: object, n: float) -> None:
    """f·cos = (min(color, 1 − specular)/pi + specular·N·cos^n)·cos wi."""
    assert callable(norm)
    material = kind(color=RED, specular=GLOSS, shininess=n)
    wo, wi = above(5000, 1), above(5000, 2)
    lobe = norm(n) * glossy(material, wo, wi)[:, None] * GLOSS
    expected = (np.minimum(RED, np.subtract(1, GLOSS)) / np.pi + lobe) * wi[:, 2:]
    np.testing.assert_allclose(bsdfs(device, [material]).value(0, wo, wi)[0], expected, rtol=1e-4, atol=1e-5)


def test_shadows_are_hard_and_only_ambient_is_left(device: Device) -> None:
    """A sphere between a sun overhead and the ground: in its shadow color·sky, outside sun and sky."""
    sun = DirectionalLight(direction=(0.0, -1.0, 0.0), irradiance=(np.pi,) * 3)
    ball = Sphere(center=(0.0, 3.0, 0.0), radius=1.0)
    camera = Camera(position=(0.0, 1.0, 0.0), up=(0.0, 0.0, -1.0), fov_degrees=120)
    picture = film(
        device,
        Scene(
            meshes=[ground(Diffuse(color=RED))],
            spheres=[ball],
            lights=[sun],
            camera=camera,
            environment=Environment(color=SKY),
            render=replace(SETTINGS, size=(32, 32)),
        ),
    ).mean
    middle, corner = picture[14:18, 14:18], picture[0, 0]
    assert np.allclose(middle, np.multiply(RED, SKY), rtol=1e-6)
    assert np.allclose(corner, np.multiply(RED, np.add(SKY, 1)), rtol=1e-5)
    levels = np.unique(np.round(picture[16, :, 0], 4))
    assert len(levels) <= 4, "two levels, and the pixels that the edge crosses"


@pytest.mark.programs
@pytest.mark.parametrize("depth", [2, 4, 7])
def test_mirrors_are_followed_to_the_depth(device: Device, depth: int) -> None:
    """Two mirrors face each other below an emissive lid; slanted rays count their reflections.

    A ray with slope 1 from the middle of a gap of 1 hits mirrors after 0.5, 1.5 and 2.5, each with reflectance 0.8, and
    reaches the lid at 3 after three mirrors: visible from depth 4 on.
    """
    sheets = [quad([(x, -9, 9), (x, -9, -9), (x, 3, -9), (x, 3, 9)], Mirror(color=(0.8,) * 3)) for x in (-0.5, 0.5)]
    lid = quad([(-9, 3, 9), (-9, 3, -9), (9, 3, -9), (9, 3, 9)], Diffuse(color=(0.0,) * 3, emission=(2.0,) * 3))
    camera = Camera(position=(0.0, 0.2, 0.0), look_at=(1.0, 1.2, 0.0), fov_degrees=0.01)
    picture = film(
        device,
        Scene(meshes=[*sheets, lid], camera=camera, render=replace(SETTINGS, size=(8, 8), max_depth=depth, spp=4)),
    ).mean
    assert np.allclose(picture, 2 * 0.8**3 if depth >= 4 else 0, rtol=1e-5)


@pytest.mark.programs
def test_glass_is_followed_both_ways(device: Device) -> None:
    """A sheet over the ground: F of what is above, 1 − F of the ground; it blocks the point light."""
    glass = ground(Dielectric(ior=1.5, thin=True), 1.0)
    camera = Camera(position=(0.0, 3.0, 0.0), up=(0.0, 0.0, -1.0), fov_degrees=0.1)
    scene = Scene(
        meshes=[glass, ground(Phong(color=RED))],
        lights=POINTS[:1],
        camera=camera,
        environment=Environment(color=SKY),
        render=replace(SETTINGS, size=(32, 32)),
    )
    share = 2 * 0.04 / 1.04
    found = film(device, scene).mean.mean(axis=(0, 1))
    noise = 4 * np.sqrt(share / 32 / 32 / 256)
    assert np.allclose(found, np.multiply(SKY, share + (1 - share) * np.array(RED)), atol=noise)


@pytest.mark.programs
def test_lamps_are_sampled_as_the_direct_integrator_does(device: Device) -> None:
    lamp = quad([(-1, 2, -1), (1, 2, -1), (1, 2, 1), (-1, 2, 1)], Diffuse(color=(0.0,) * 3, emission=(3.0, 2.0, 1.0)))
    scene = Scene(
        meshes=[ground(Diffuse(color=RED)), lamp],
        camera=Camera(position=EYE),
        render=SETTINGS,
        spheres=[Sphere(center=(0.0, 0.5, 0.0), radius=0.5)],
    )
    direct = replace(scene, render=replace(SETTINGS, integrator="direct", max_depth=2))
    found, expected = (film(device, each).mean.mean(axis=(0, 1)) for each in (scene, direct))
    np.testing.assert_allclose(found, expected, rtol=0.01)


@pytest.mark.programs
def test_lanes_agree_and_paths_pay_nothing(device: Device) -> None:
    scene = Scene(
        meshes=[ground(Phong())],
        spheres=[Sphere(center=(0.0, 0.5, 0.0), radius=0.5, material=Mirror())],
        lights=POINTS,
        camera=Camera(position=EYE),
        environment=Environment(color=SKY),
        render=SETTINGS,
    )
    one, eight = (film(device, scene, spp=4, lanes=lanes).mean for lanes in (1, 8))
    np.testing.assert_allclose(one, eight, rtol=1e-4, atol=1e-6)
    compiled = compile_scene(replace(scene, render=RenderSettings()), Choices())
    assert "LOCAL" not in compiled.features and compiled.kernel == "wavefront"
    assert "integrator/local.cl" not in compiled.files
