"""White furnace tests, and the energy that multiple scattering between microfacets restores."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.bench.numerics.bsdf_cases import bsdfs
from clrt.bench.numerics.furnace import SMITHS, Reflected, evenly, inexact, measure_glass, measure_metals
from clrt.bench.numerics.scattering import ROUNDING, above, reciprocity
from clrt.device.open import Device
from clrt.formats.load_scene import load
from clrt.rendering.compile.choices import Choices
from clrt.rendering.compile.compile_scene import compile_scene
from clrt.scene.materials.material_types import Dielectric, MetallicRoughness
from clrt.scene.materials.metallic_roughness import Smith
from clrt.scene.materials.textures import Picture, Texture
from clrt.scene.model import Camera, Environment, RenderSettings, Scene, Sphere

from . import ggx
from .pictures import film

pytestmark = pytest.mark.statistics

Doubles = NDArray[np.float64]
SAMPLES = 1 << 14
WHITE = (1.0, 1.0, 1.0)


@pytest.fixture(scope="module")
def metals(device: Device) -> list[Reflected]:
    """Return measurements at every roughness and angle, for each shadowing form, without and with multiple
    scattering."""
    return list(measure_metals(device, SAMPLES))


def test_diffuse_and_mirror_reflect_their_color_exactly(device: Device) -> None:
    assert inexact(device, SAMPLES)[0] == 0


def test_one_bounce_reflects_its_albedo(metals: list[Reflected]) -> None:
    """Device samples against a quadrature; the sampled mean converges to 1e-4."""
    single = [metal for metal in metals if not metal.material.multiple_scattering]
    assert len(single) == 360
    assert max(abs(metal.found - metal.exact) for metal in single) < 3e-4


def test_multiple_scattering_reflects_all(metals: list[Reflected]) -> None:
    """The deviation from 1 is that of the fitted albedo and of the sampling."""
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
    fresnel = weights @ (mu[:, None] * (f0 + (1 - f0) * (1 - mu[:, None]) ** 5))
    color = fresnel**2 * average / (1 - fresnel * (1 - average))
    wo, wi = (np.array([[np.sqrt(1 - c * c), 0.0, c] for c in some]) for some in ([1.0, 0.5, 0.1], [0.2, 0.7, 0.4]))
    loss = [1 - np.array([ggx.albedo(alpha, w[2], "height_correlated", 1000) for w in some]) for some in (wo, wi)]
    added = metals.value(1, wo, wi)[0] - metals.value(0, wo, wi)[0]
    expected = color * (loss[0] * loss[1] * wi[:, 2] / np.pi / (1 - average))[:, None]
    np.testing.assert_allclose(added, expected, rtol=3e-3)


@pytest.mark.parametrize("smith", SMITHS)
def test_white_reflects_all(device: Device, smith: Smith) -> None:
    """For any metallic, index and specular: what the gloss does not reflect, the body does."""
    rng = np.random.default_rng(SMITHS.index(smith))
    materials = [
        MetallicRoughness(
            color=WHITE,
            metallic=rng.choice([0, rng.random(), 1]),
            roughness=rng.random(),
            ior=1 + 3 * rng.random() ** 2,
            specular=rng.choice([1, rng.random()]),
            smith=smith,
            specular_color=tuple(rng.choice([1, rng.random()], 3)),
            coupling="albedo",
            multiple_scattering=True,
        )
        for _ in range(40)
    ]
    whites, numbers = bsdfs(device, [*materials]), evenly(SAMPLES)
    for which, material in enumerate(materials):
        for cosine in (1.0, rng.random(), 0.1 * rng.random(), 0.01):
            wo = np.array([np.sqrt(1 - cosine**2), 0, cosine])
            found = whites.sample(which, wo, numbers)[1].mean(axis=0)
            np.testing.assert_allclose(found, 1, atol=2e-3, err_msg=f"{material} at {cosine}")


@pytest.mark.parametrize("metallic", [0.0, 0.5, 0.9])
def test_white_coupled_by_fresnel_makes_no_light(device: Device, metallic: float) -> None:
    """A white body below a gloss with multiple scattering, whose energy is reflected before light enters the body."""
    materials = [
        MetallicRoughness(
            color=WHITE, metallic=metallic, roughness=roughness, coupling="fresnel", multiple_scattering=True
        )
        for roughness in (0.0, 0.1, 0.3, 0.6, 1.0)
    ]
    whites, numbers = bsdfs(device, [*materials]), evenly(SAMPLES)
    for which, material in enumerate(materials):
        for cosine in (1.0, 0.5, 0.1, 0.01, 1e-3):
            wo = np.array([np.sqrt(1 - cosine**2), 0, cosine])
            assert whites.sample(which, wo, numbers)[1].mean() < 1, (material, cosine)


def test_samples_weigh_little(device: Device) -> None:
    """The lobe's own sampling keeps weights bounded; cosine sampling gives weights of 1e5 at low roughness."""
    metals = [
        MetallicRoughness(color=WHITE, metallic=1.0, roughness=roughness, multiple_scattering=True)
        for roughness in (0.0, 0.05, 0.2, 0.5, 1.0)
    ]
    whites, numbers = bsdfs(device, [*metals]), evenly(1 << 16)
    for which in range(len(metals)):
        for cosine in (1.0, 0.1, 1e-3):
            wo = np.array([np.sqrt(1 - cosine**2), 0, cosine])
            assert whites.sample(which, wo, numbers)[1].max() < 4


def random_glasses(rng: np.random.Generator, count: int) -> list[Dielectric]:
    """Return rough glasses of any index, a third of them close to 1; every fourth is a thin sheet."""
    near = 1 + rng.choice([-1, 1], count) * 10 ** rng.uniform(-2.5, -1, count)
    iors = np.where(rng.random(count) < 1 / 3, near, 4 ** rng.uniform(-1, 1, count))
    return [
        Dielectric(ior=float(ior), roughness=float(roughness), thin=i % 4 == 3)
        for i, (ior, roughness) in enumerate(zip(iors, rng.uniform(0.01, 1, count)))
    ]


def test_rough_glass_keeps_all_light(device: Device) -> None:
    """All energy leaves, from both sides, at every angle; sampling converges slowest at the most grazing one."""
    kept = list(measure_glass(device, 2 * SAMPLES, random_glasses(np.random.default_rng(3), 12)))
    assert len(kept) == 240
    assert not [glass for glass in kept if not abs(glass.found - 1) < (2e-3 if glass.cosine > 1e-4 else 5e-3)]


def test_rough_glass_is_reciprocal(device: Device) -> None:
    glasses = random_glasses(np.random.default_rng(4), 8)
    subject = bsdfs(device, [*glasses])
    for which, glass in enumerate(glasses):
        assert reciprocity(subject, which, 4000, which).max() < 5 * ROUNDING, glass


def test_rough_glass_from_inside_is_that_of_the_inverse_index(device: Device) -> None:
    """Samples, weights and densities from inside; the other tests cover those from outside."""
    numbers = evenly(1 << 12)
    for ior, roughness in ((1.5, 0.3), (2.0, 1.0), (0.5, 0.6), (1.25, 0.1)):
        glass = bsdfs(device, [Dielectric(ior=ior, roughness=roughness), Dielectric(ior=1 / ior, roughness=roughness)])
        for cosine in (0.9, 0.4, 0.05):
            wo = np.array([np.sqrt(1 - cosine**2), 0.0, cosine])
            inside, outside = glass.sample(0, wo, numbers, front=False), glass.sample(1, wo, numbers)
            same = inside[2] > 0
            assert same.mean() > 0.4 and np.mean(same == (outside[2] > 0)) > 0.999
            wi = inside[0][same]
            for found, expected in zip(glass.value(0, wo, wi, front=False), glass.value(1, wo, wi)):
                np.testing.assert_allclose(found, expected, rtol=2e-3)
            assert np.median(np.abs(inside[1] - outside[1])) < 1e-4


def test_a_furnace_does_not_see_rough_glass(device: Device) -> None:
    """Paths go through a sphere, and the image is 1; single scattering between microfacets loses a large part."""
    for multiple in (True, False):
        ball = Sphere(material=Dielectric(roughness=0.8, multiple_scattering=multiple))
        camera = Camera(position=(0.0, 0.0, 9.0), fov_degrees=8.0)
        mean = film(
            device,
            Scene(
                spheres=[ball],
                camera=camera,
                environment=Environment(color=WHITE),
                render=RenderSettings(size=(32, 32), spp=256, max_depth=256),
            ),
        ).mean.mean()
        assert abs(mean - 1) < 3e-3 if multiple else mean < 0.8


def test_textured_rough_glass_keeps_all_light(device: Device) -> None:
    """Also between the rows of its table, which other glass of the scene does not use."""
    textures = [Texture(picture=Picture(np.full((1, 1, 4), grey, np.uint8))) for grey in (0, 12, 31, 60, 129, 200, 255)]
    glasses = [Dielectric(roughness=0.4), *(Dielectric(roughness=texture) for texture in textures)]
    kept = list(measure_glass(device, 2 * SAMPLES, glasses))
    assert not [glass for glass in kept if not abs(glass.found - 1) < 2e-3]
    assert any(glass.found != 1 for glass in kept if glass.glass.roughness == textures[3])


def test_single_scattering_of_rough_glass_loses_light(device: Device) -> None:
    """Multiple scattering restores this loss, which exceeds half at its largest."""
    glass = Dielectric(roughness=1.0, multiple_scattering=False)
    assert min(kept.found for kept in measure_glass(device, SAMPLES, [glass])) < 0.5


def test_only_those_who_ask_pay(device: Device) -> None:
    """Other scenes compile no code for it, and a material without it is unchanged in a scene that has it."""
    plain, full = (
        MetallicRoughness(roughness=0.7, metallic=0.5, coupling="fresnel", multiple_scattering=multiple)
        for multiple in (False, True)
    )
    alone, both = (
        compile_scene(
            Scene(spheres=[Sphere(material=material) for material in materials]), Choices(device.lanes, device.layout)
        )
        for materials in ([plain], [plain, full])
    )
    for feature in ("MULTIPLE_SCATTERING", "GGX_ALBEDO"):
        assert feature not in alone.features and feature in both.features
    wo, wi = above(4000, 1), above(4000, 2)
    values = [bsdfs(device, [*materials]).value(0, wo, wi) for materials in ([plain], [plain, full])]
    for found, expected in zip(*values):
        np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-7)


def test_scene_file(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(
        '[materials.iron]\ntype = "metallic_roughness"\npreset = "iron"\n'
        'multiple_scattering = true\n[[sphere]]\nmaterial = "iron"\n'
    )
    material = load(tmp_path / "scene.toml").spheres[0].material
    assert material == MetallicRoughness(preset="iron", multiple_scattering=True)
