"""Rough and thin glass, and absorption: float64 formulas, and scenes with known results."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from clrt.bench.kernel_probe import Doubles
from clrt.bench.numerics.bsdf_cases import bsdfs, uniform, view
from clrt.bench.numerics.scattering import above
from clrt.device.open import Device
from clrt.rendering.compile.choices import Choices
from clrt.rendering.compile.compile_scene import compile_scene
from clrt.scene.lights import Light, PointLight
from clrt.scene.materials.material_types import Dielectric, Diffuse, Material, MetallicRoughness
from clrt.scene.model import Camera, Environment, Instance, Mesh, RenderSettings, Scene, Sphere
from clrt.scene.render_settings import Integrator

from .ggx import masking
from .pictures import film, quad
from .test_dielectric import fresnel

pytestmark = pytest.mark.statistics

COLOR = (0.9, 0.5, 1.0)
WHITE = Environment(color=(1.0, 1.0, 1.0))
#: Camera that looks down on the origin from a height of 4.
DOWN = Camera(position=(0.0, 0.0, 4.0), fov_degrees=0.02)


def walter(eta: float, alpha: float, wo: Doubles, wi: Doubles) -> Doubles:
    """Return f·|cos wi| (n,) by eq. 20 and 21 (Walter et al. 2007), for light that arrives along wi, from a medium of
    index eta if that is below, and leaves along wo into one of index 1; G of both as in eq. 99 of Heitz 2014."""
    refracted = wi[:, 2] < 0
    sum_ = np.where(refracted[:, None], -(eta * wi + wo), wi + wo)
    h = sum_ / np.linalg.norm(sum_, axis=1, keepdims=True)
    h *= np.sign(h[:, 2:])
    cos_o, cos_i = np.sum(wo * h, axis=1), np.sum(wi * h, axis=1)
    tan2 = (1 - h[:, 2] ** 2) / h[:, 2] ** 2
    d = alpha**2 / (np.pi * h[:, 2] ** 4 * (alpha**2 + tan2) ** 2)
    common = d * masking("height_correlated", alpha, wo[:, 2], np.abs(wi[:, 2]))
    f = fresnel(np.maximum(cos_o, 0), eta)
    reflection = f * common / (4 * wo[:, 2])
    transmission = np.abs(cos_i * cos_o) / wo[:, 2] * (1 - f) * common / (eta * cos_i + cos_o) ** 2
    possible = (cos_o > 0) & (~refracted | (cos_i < 0))
    return np.asarray(np.where(possible, np.where(refracted, transmission, reflection), 0))


@pytest.mark.parametrize("front", [True, False])
@pytest.mark.parametrize("ior", [0.7, 1.5, 2.4])
def test_it_is_walters(device: Device, ior: float, front: bool) -> None:
    roughness = 0.6
    glass = bsdfs(device, [Dielectric(ior=ior, roughness=roughness, color=COLOR, multiple_scattering=False)])
    wo, wi = above(20_000, 1), above(20_000, 2) * np.where(np.arange(20_000) % 3 == 0, 1, -1)[:, None] ** [0, 0, 1]
    expected = walter(ior if front else 1 / ior, roughness**2, wo, wi)[:, None] * np.where(wi[:, 2:] < 0, COLOR, 1)
    found = glass.value(0, wo, wi, front)[0]
    # Half vectors are known to some roundings, except where wi nearly continues wo.
    known = np.linalg.norm(wo + (ior if front else 1 / ior) * wi, axis=1) > 0.05
    assert np.all(np.abs(found - expected)[known] <= 2e-4 * expected[known] + 2e-6)
    assert (found[wi[:, 2] < 0] > 0).any(axis=1).mean() > 0.05


def test_the_smoothest_is_smooth(device: Device) -> None:
    """alpha = 1e-4: shares, weights and directions are those of Fresnel and Snell."""
    smooth, rough = Dielectric(ior=1.5, color=COLOR), Dielectric(ior=1.5, color=COLOR, roughness=0.01)
    glass, numbers = bsdfs(device, [smooth, rough]), uniform(1 << 16, 1)
    for front in (True, False):
        for cosine in (1.0, 0.8, 0.3):
            wi, weight, pdf, _ = glass.sample(1, view(cosine), numbers, front)
            exact, exact_weight, *_ = glass.sample(0, view(cosine), numbers, front)
            same = wi[:, 2] * exact[:, 2] > 0
            assert same.mean() > 1 - 2e-3 and pdf.min() >= 0
            assert np.median(np.linalg.norm(wi - exact, axis=1)[same]) < 3e-4
            assert np.abs(weight - exact_weight)[same & (pdf > 0)].mean() < 1e-4


@pytest.mark.parametrize("front", [True, False])
def test_energy_is_that_of_a_single_bounce(device: Device, front: bool) -> None:
    """The mean sample weight in a white furnace equals Walter's formula over directions of the whole sphere."""
    count, eta = 1 << 20, 1.5 if front else 1 / 1.5
    rng = np.random.default_rng(7)
    z, turn = rng.uniform(-1, 1, count), rng.uniform(0, 2 * np.pi, count)
    wi = np.column_stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z])
    cosine = np.sqrt(rng.uniform(0, 1, (count, 1)))
    wo = np.hstack([np.sqrt(1 - cosine**2), np.zeros_like(cosine), cosine])
    power = np.where(z < 0, eta**2, 1)
    for roughness, least in ((0.6, 0.75), (1.0, 0.45)):
        expected = 4 * np.pi * walter(eta, roughness**2, wo, wi) * power
        glass = bsdfs(device, [Dielectric(roughness=roughness, multiple_scattering=False)])
        kept = glass.sample(0, wo[: 1 << 16], uniform(1 << 16, 3), front)[1][:, 0]
        error = np.hypot(expected.std() / np.sqrt(count), kept.std() / np.sqrt(len(kept)))
        assert least < kept.mean() < 1 and kept.mean() == pytest.approx(expected.mean(), abs=4.5 * error)


def test_thin_glass_is_the_sum_of_its_bounces(device: Device) -> None:
    """F + (1 − F)²·Σ c^2k·F^(2k−1), and (1 − F)²·Σ c^(2k+1)·F^2k; not refracted; 2F/(1 + F) if c = 1."""
    sheets = bsdfs(device, [Dielectric(ior=1.5, color=COLOR, thin=True), Dielectric(ior=1.5, thin=True)])
    numbers, c, k = uniform(1 << 16, 5), np.array(COLOR), np.arange(1, 200)[:, None]
    for cosine in (1.0, 0.4, 0.1):
        f = fresnel(np.array([cosine]), 1.5)
        reflected = f + (1 - f) ** 2 * (c ** (2 * k) * f ** (2 * k - 1)).sum(axis=0)
        passed = (1 - f) ** 2 * (c ** (2 * k - 1) * f ** (2 * k - 2)).sum(axis=0)
        for front in (True, False):
            wi, weight, _, specular = sheets.sample(0, view(cosine), numbers, front)
            back = wi[:, 2] > 0
            assert specular.all() and np.allclose(wi[~back], -view(cosine), atol=1e-7)
            for chosen, expected in ((back, reflected), (~back, passed)):
                assert np.allclose(np.where(chosen[:, None], weight, 0).mean(axis=0), expected, atol=4e-3 * 2)
        share = (sheets.sample(1, view(cosine), numbers)[0][:, 2] > 0).mean()
        assert share == pytest.approx(float((2 * f / (1 + f))[0]), abs=4 * np.sqrt(0.25 / len(numbers)))


def _plane(z: float, material: Material, half: float = 99.0) -> Mesh:
    """Return the square around the z axis at this height, facing up."""
    return quad([(-half, -half, z), (half, -half, z), (half, half, z), (-half, half, z)], material)


def test_light_behind_ground_glass_is_found(device: Device) -> None:
    """A small emitter below it, sampled as a light: radiance is f(wo, wi)·cos·L·Ω, for any number of lights."""
    glass = Dielectric(ior=1.5, roughness=0.5, color=COLOR)
    lamp = Sphere(center=(0.3, 0.4, -1.0), radius=0.01, material=Diffuse(emission=(9e4, 9e4, 9e4)))
    scene = Scene(
        meshes=[_plane(0.0, glass)],
        spheres=[lamp],
        camera=DOWN,
        render=RenderSettings(size=(16, 16), spp=256, max_depth=2),
    )
    wi = np.array([[0.3, 0.4, -1.0]]) / np.sqrt(1.25)
    value = bsdfs(device, [glass]).value(0, np.array([0.0, 0.0, 1.0]), wi)[0]
    expected = np.broadcast_to(value * 9e4 * np.pi * 1e-4 / 1.25, (16, 16, 3))
    crowd: list[Light] = [PointLight(position=(0.0, 0.0, 50.0 + i), intensity=(1e-6,) * 3) for i in range(3)]
    for others in ([], crowd):
        picture = film(device, replace(scene, lights=others))
        assert np.allclose(picture.mean.mean(axis=(0, 1)), expected[0, 0], rtol=0.01)


def test_found_and_sampled_light_through_ground_glass_agree(device: Device) -> None:
    """A large emitter below a rough surface with MIS: radiance is the transmitted furnace energy over 1.5²."""
    glass = Dielectric(ior=1.5, roughness=0.7)
    lamp = _plane(-0.5, Diffuse(color=(0.0, 0.0, 0.0), emission=(1.0, 1.0, 1.0)), 500.0)
    scene = Scene(
        meshes=[_plane(0.0, glass), lamp], camera=DOWN, render=RenderSettings(size=(16, 16), spp=1024, max_depth=2)
    )
    wi, weight, _, _ = bsdfs(device, [glass]).sample(0, np.array([0.0, 0.0, 1.0]), uniform(1 << 18, 9))
    expected = float(weight[wi[:, 2] < 0][:, 0].sum() / len(wi) / 2.25)
    assert film(device, scene).mean.mean() == pytest.approx(expected, rel=0.01)


def test_glass_absorbs_by_the_way_inside(device: Device) -> None:
    """A slab of thickness d under a white sky: F, and T = color^(d/distance) for every internal crossing."""
    glass = Dielectric(ior=1.5, attenuation_color=COLOR, attenuation_distance=0.5)
    back = quad([(-99, 99, -2), (99, 99, -2), (99, -99, -2), (-99, -99, -2)], glass)
    picture = film(
        device,
        Scene(
            meshes=[_plane(-1.0, glass), back],
            camera=DOWN,
            environment=WHITE,
            render=RenderSettings(size=(32, 32), spp=256, max_depth=32),
        ),
    )
    t, f = np.array(COLOR) ** 2, 0.04
    through = (1 - f) ** 2 * t / (1 - (f * t) ** 2)
    expected = f + through + through * f * t
    noise = 4 * np.sqrt(f * (1 - f) / picture.pixels["count"].sum())
    assert np.allclose(picture.mean.mean(axis=(0, 1)), expected, rtol=1e-6, atol=noise)


@pytest.mark.parametrize(
    ("sheet", "integrator"),
    [
        (Dielectric(ior=1.0, thin=True), "path"),
        (Dielectric(ior=1.0, thin=True), "local"),
        (MetallicRoughness(color=(1.0, 1.0, 1.0), ior=1.0, roughness=0.0, transmission=1.0), "path"),
    ],
)
def test_a_sheet_does_not_end_what_absorbs(device: Device, sheet: Material, integrator: Integrator) -> None:
    """A non-refracting slab of thickness 2 with a clear sheet across it: color^(2/distance) of a white sky."""
    glass = Dielectric(ior=1.0, attenuation_color=COLOR, attenuation_distance=0.5)
    back = quad([(-99, 99, -2), (99, 99, -2), (99, -99, -2), (-99, -99, -2)], glass)
    picture = film(
        device,
        Scene(
            meshes=[_plane(0.0, glass), back, _plane(-0.7, sheet)],
            camera=DOWN,
            environment=WHITE,
            render=RenderSettings(size=(8, 8), spp=1, integrator=integrator),
        ),
    )
    assert np.allclose(picture.mean, np.array(COLOR) ** 4, rtol=2e-3)


@pytest.mark.parametrize("integrator", ["path", "local", "raster"])
@pytest.mark.parametrize("placed", [False, True])
@pytest.mark.parametrize("scale", [1.0, 2.0**30])
def test_light_inside_is_absorbed_on_its_way_too(
    device: Device, scale: float, placed: bool, integrator: Integrator
) -> None:
    """A point light in a non-refracting box lights its floor: albedo·I/(pi·d²)·color^((d + camera
    distance)/distance)."""
    box = Dielectric(ior=1.0, attenuation_color=COLOR, attenuation_distance=scale)
    floor = _plane(-scale, Diffuse(color=(0.5, 0.5, 0.5)), 2 * scale)
    light = PointLight(position=(0.0, 0.0, -scale / 2), intensity=(7.0 * scale**2,) * 3)
    lid = _plane(0.0, box, 9 * scale)
    parts: dict[str, Any] = {"meshes": [floor], "instances": [Instance(lid)]} if placed else {"meshes": [lid, floor]}
    picture = film(
        device,
        Scene(
            **parts,
            lights=[light],
            camera=replace(DOWN, position=(0.0, 0.0, 4.0 * scale)),
            render=RenderSettings(size=(8, 8), spp=4, max_depth=3, integrator=integrator),
        ),
    )
    expected = 0.5 / np.pi * 7 / 0.25 * np.array(COLOR) ** 1.5
    assert np.allclose(picture.mean, expected, rtol=1e-4)


def test_only_glass_that_asks_pays(device: Device) -> None:
    """Smooth glass without absorption compiles no code for either."""

    def compiled(*materials: Dielectric) -> str:
        return compile_scene(
            Scene(spheres=[Sphere(material=m) for m in materials], environment=WHITE), Choices(device.lanes)
        ).source

    plain = compiled(Dielectric())
    assert "visible_normal" not in plain and "roughness" not in plain.split('#line 1 "')[0]
    assert "rough_dielectric.cl" in compiled(Dielectric(roughness=0.2))
    for name in ("THIN_DIELECTRIC", "ATTENUATION", "ROUGH_DIELECTRIC", "DIELECTRIC_ENERGY", "TRANSMISSION_LOBES"):
        assert f"#define {name} 1" not in plain
