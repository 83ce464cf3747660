"""White furnaces, and the light that multiple scattering between microfacets gives back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.device.open import Device
from clrt.rendering.choices import Choices
from clrt.rendering.compile import compile_scene
from clrt.scene.file import load
from clrt.scene.materials import MetallicRoughness
from clrt.scene.metallic_roughness import Smith
from clrt.scene.model import Scene, Sphere
from clrt.study.bsdfs import bsdfs
from clrt.study.furnace import SMITHS, Reflected, evenly, inexact, measure_metals
from clrt.study.scattering import above

from . import ggx

Doubles = NDArray[np.float64]
SAMPLES = 1 << 14
WHITE = (1.0, 1.0, 1.0)


@pytest.fixture(scope="module")
def metals(device: Device) -> list[Reflected]:
    """Of every roughness from every angle, with each form of shadowing, without and with multiple scattering."""
    return list(measure_metals(device, SAMPLES))


def test_diffuse_and_mirror_reflect_their_color_exactly(device: Device) -> None:
    assert inexact(device, SAMPLES)[0] == 0


def test_one_bounce_reflects_its_albedo(metals: list[Reflected]) -> None:
    """Sampled on the device against a quadrature; what is sampled converges to 1e-4."""
    single = [metal for metal in metals if not metal.material.multiple_scattering]
    assert len(single) == 360
    assert max(abs(metal.found - metal.exact) for metal in single) < 3e-4


def test_multiple_scattering_reflects_all(metals: list[Reflected]) -> None:
    """The error of the fitted albedo, and of the sampling."""
    for smith, most in zip(SMITHS, (1e-3, 1e-3, 1.5e-3, 2e-3), strict=True):
        errors = [abs(m.found - 1) for m in metals if m.material.multiple_scattering and m.material.smith == smith]
        assert len(errors) == 90 and max(errors) < most, smith


def test_what_is_added_is_kulla_and_contys_lobe(device: Device) -> None:
    """F_ms·(1 − E(wo))·(1 − E(wi))/(pi·(1 − E_avg)), F_ms = F_avg²·E_avg/(1 − F_avg·(1 − E_avg)), E by brute force."""
    gold = [MetallicRoughness(preset="gold", roughness=0.8, multiple_scattering=multiple) for multiple in (False, True)]
    metals, alpha, f0 = bsdfs(device, [*gold]), 0.8**2, np.array([1.0, 0.71, 0.29])
    nodes, weights = np.polynomial.legendre.leggauss(12)
    mu = (nodes + 1) / 2
    average = weights @ [mu_i * ggx.albedo(alpha, mu_i, "height_correlated") for mu_i in mu]
    fresnel = weights @ (mu[:, None] * (f0 + (1 - f0) * (1 - mu[:, None])**5))
    color = fresnel**2 * average / (1 - fresnel * (1 - average))
    wo, wi = (np.array([[np.sqrt(1 - c * c), 0.0, c] for c in some]) for some in ([1.0, 0.5, 0.1], [0.2, 0.7, 0.4]))
    loss = [1 - np.array([ggx.albedo(alpha, w[2], "height_correlated", 1000) for w in some]) for some in (wo, wi)]
    added = metals.value(1, wo, wi)[0] - metals.value(0, wo, wi)[0]
    expected = color * (loss[0] * loss[1] * wi[:, 2] / np.pi / (1 - average))[:, None]
    np.testing.assert_allclose(added, expected, rtol=3e-3)


@pytest.mark.parametrize("smith", SMITHS)
def test_white_reflects_all(device: Device, smith: Smith) -> None:
    """Whatever its metal, index and speculars: what the gloss does not reflect comes out of the body."""
    rng = np.random.default_rng(SMITHS.index(smith))
    materials = [MetallicRoughness(color=WHITE, metallic=rng.choice([0, rng.random(), 1]), roughness=rng.random(),
                                   ior=1 + 3 * rng.random()**2, specular=rng.choice([1, rng.random()]), smith=smith,
                                   specular_color=tuple(rng.choice([1, rng.random()], 3)), coupling="albedo",
                                   multiple_scattering=True) for _ in range(40)]
    whites, numbers = bsdfs(device, [*materials]), evenly(SAMPLES)
    for which, material in enumerate(materials):
        for cosine in (1.0, rng.random(), 0.1 * rng.random(), 0.01):
            wo = np.array([np.sqrt(1 - cosine**2), 0, cosine])
            found = whites.sample(which, wo, numbers)[1].mean(axis=0)
            np.testing.assert_allclose(found, 1, atol=2e-3, err_msg=f"{material} at {cosine}")


@pytest.mark.parametrize("metallic", [0.0, 0.5, 0.9])
def test_white_coupled_by_fresnel_makes_no_light(device: Device, metallic: float) -> None:
    """A white body under a gloss with multiple scattering, which is reflected before light enters the body."""
    materials = [MetallicRoughness(color=WHITE, metallic=metallic, roughness=roughness, coupling="fresnel",
                                   multiple_scattering=True) for roughness in (0.0, 0.1, 0.3, 0.6, 1.0)]
    whites, numbers = bsdfs(device, [*materials]), evenly(SAMPLES)
    for which, material in enumerate(materials):
        for cosine in (1.0, 0.5, 0.1, 0.01, 1e-3):
            wo = np.array([np.sqrt(1 - cosine**2), 0, cosine])
            assert whites.sample(which, wo, numbers)[1].mean() < 1, (material, cosine)


def test_samples_weigh_little(device: Device) -> None:
    """Its own lobe keeps weights bounded: the cosine's would give some of 1e5 at low roughness."""
    metals = [MetallicRoughness(color=WHITE, metallic=1.0, roughness=roughness, multiple_scattering=True)
              for roughness in (0.0, 0.05, 0.2, 0.5, 1.0)]
    whites, numbers = bsdfs(device, [*metals]), evenly(1 << 16)
    for which in range(len(metals)):
        for cosine in (1.0, 0.1, 1e-3):
            wo = np.array([np.sqrt(1 - cosine**2), 0, cosine])
            assert whites.sample(which, wo, numbers)[1].max() < 4


def test_only_those_who_ask_pay(device: Device) -> None:
    """No code for it in other scenes; beside one that has it, a material without stays as it was."""
    plain, full = (MetallicRoughness(roughness=0.7, metallic=0.5, coupling="fresnel", multiple_scattering=multiple)
                   for multiple in (False, True))
    alone, both = (compile_scene(Scene(spheres=[Sphere(material=material) for material in materials]),
                                 Choices(device.lanes, device.layout)) for materials in ([plain], [plain, full]))
    for feature in ("MULTIPLE_SCATTERING", "GGX_ALBEDO"):
        assert feature not in alone.features and feature in both.features
    wo, wi = above(4000, 1), above(4000, 2)
    values = [bsdfs(device, [*materials]).value(0, wo, wi) for materials in ([plain], [plain, full])]
    for found, expected in zip(*values):
        np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-7)


def test_scene_file(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text('[materials.iron]\ntype = "metallic_roughness"\npreset = "iron"\n'
                                         'multiple_scattering = true\n[[sphere]]\nmaterial = "iron"\n')
    material = load(tmp_path / "scene.toml").spheres[0].material
    assert material == MetallicRoughness(preset="iron", multiple_scattering=True)
