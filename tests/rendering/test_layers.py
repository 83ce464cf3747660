"""glTF's extensions of metallic_roughness: float64 formulas, furnaces, and no cost for other materials."""

from __future__ import annotations

import numpy as np
import pytest

from clrt.bench.kernel_probe import Doubles
from clrt.bench.numerics.bsdf_cases import Bsdfs, bsdfs, uniform
from clrt.bench.numerics.scattering import FLIP, above
from clrt.device.open import Device
from clrt.rendering.compile.choices import Choices
from clrt.rendering.compile.compile_scene import compile_scene
from clrt.scene.materials.material_types import MetallicRoughness
from clrt.scene.model import Scene, Sphere

from . import sheen
from .ggx import masking
from .layers import Below, Left, lost, mean, under_coat, under_fibres

pytestmark = pytest.mark.statistics

COLOR = (0.8, 0.5, 0.2)
WO, WI = above(5000, 1), above(5000, 2)
H = (WO + WI) / np.linalg.norm(WO + WI, axis=1, keepdims=True)
COS_H, COS_O, COS_I = np.sum(WO * H, axis=1), WO[:, 2], WI[:, 2]


def shown(device: Device, *materials: MetallicRoughness) -> Bsdfs:
    """Return the materials and one with all layers, so that all run the same program."""
    full = MetallicRoughness(
        clearcoat=0.5, sheen_color=(0.5,) * 3, transmission=0.5, specular=0.5, specular_color=(0.2,) * 3
    )
    return bsdfs(device, [*materials, full])


def schlick(f0: float, cosine: Doubles, f90: float = 1.0) -> Doubles:
    return np.asarray(f0 + (f90 - f0) * (1 - cosine) ** 5)


def ggx(alpha: float) -> Doubles:
    """Return D·G/(4·cos wo), (n,)."""
    tan2 = (1 - H[:, 2] ** 2) / H[:, 2] ** 2
    d = alpha**2 / (np.pi * H[:, 2] ** 4 * (alpha**2 + tan2) ** 2)
    return np.asarray(d * masking("height_correlated", alpha, COS_O, COS_I) / (4 * COS_O))


def check(found: Doubles, expected: Doubles) -> None:
    """Assert equality up to the rounding error of float32 half vectors."""
    roundings = 2e-5 / np.linalg.norm(WO + WI, axis=1, keepdims=True)
    assert np.all(np.abs(found - expected) <= roundings * np.abs(expected) + 2e-5)


def beneath(left: Left, metallic: float, roughness: float, some: slice = slice(None)) -> Doubles:
    """Return the value of the base below layers, (n, 3)."""
    body = Below(COLOR, metallic, roughness, left)
    cos_o, cos_i = COS_O[some], COS_I[some]
    gloss = (body.f0 + (1 - body.f0) * (1 - COS_H[some, None]) ** 5) * ggx(roughness**2)[some, None]
    return body.value(gloss, cos_o, cos_i, left(cos_o), left(cos_i))


@pytest.mark.parametrize("metallic", [0.0, 0.5, 1.0])
def test_coat_lies_over_what_was_there(device: Device, metallic: float) -> None:
    """coat·F·D·G/(4 cos wo), plus the base attenuated by the coat's albedo."""
    coated = shown(
        device, MetallicRoughness(color=COLOR, roughness=0.7, metallic=metallic, clearcoat=0.8, clearcoat_roughness=0.5)
    )
    film = (0.8 * schlick(0.04, COS_H) * ggx(0.25))[:, None]
    expected = film + beneath(under_coat(0.8, 0.5), metallic, 0.7)
    np.testing.assert_allclose(coated.value(0, WO, WI)[0], expected, rtol=2e-3, atol=1e-4)


@pytest.mark.parametrize("roughness", [0.2, 0.5, 1.0])
def test_sheen_is_charlies(device: Device, roughness: float) -> None:
    """color·(2 + n)·sin^n/(2 pi)·cos wi/(4 (o + i − o·i)), over the larger E if it exceeds 1, plus the attenuated
    base."""
    woolly = MetallicRoughness(color=COLOR, sheen_color=(0.9, 0.6, 0.3), sheen_roughness=roughness)
    found, n, some = shown(device, woolly), roughness**-2, slice(1000)
    wo, wi, cos_o, cos_i = WO[some], WI[some], COS_O[some], COS_I[some]
    e_o, e_i = (sheen.albedo(cosine, n) for cosine in (cos_o, cos_i))
    d = (2 + n) / (2 * np.pi) * (1 - H[some, 2] ** 2) ** (n / 2)
    fibres = d * cos_i / (4 * (cos_o + cos_i - cos_o * cos_i)) / np.maximum(np.maximum(e_o, e_i), 1)
    expected = fibres[:, None] * (0.9, 0.6, 0.3) + beneath(under_fibres(0.9, roughness), 0.0, 0.5, some)
    np.testing.assert_allclose(found.value(0, wo, wi)[0], expected, rtol=3e-3, atol=3e-3)


@pytest.mark.parametrize("roughness", [0.15, 0.4, 1.0])
def test_fibres_reflect_what_was_fitted(device: Device, roughness: float) -> None:
    """White fibres on black: E by brute force over the hemisphere, where it is below 1."""
    woolly = shown(
        device, MetallicRoughness(color=(0.0,) * 3, specular=0.0, sheen_color=(1.0,) * 3, sheen_roughness=roughness)
    )
    for cosine in (1.0, 0.7, 0.4):
        wo = np.array([np.sqrt(1 - cosine**2), 0, cosine])
        found = woolly.sample(0, wo, uniform(1 << 16, 1))[1][:, 0].mean()
        z, phi = np.meshgrid((np.arange(800) + 0.5) / 800, 2 * np.pi * (np.arange(400) + 0.5) / 400, indexing="ij")
        wi = np.stack([np.sqrt(1 - z * z) * np.cos(phi), np.sqrt(1 - z * z) * np.sin(phi), z], axis=-1)
        h = (wo + wi) / np.linalg.norm(wo + wi, axis=-1, keepdims=True)
        n = roughness**-2
        f = (2 + n) / (2 * np.pi) * (1 - h[..., 2] ** 2) ** (n / 2) / (4 * (cosine + z - cosine * z))
        bound = np.maximum(sheen.albedo(z[:, 0], n), max(float(sheen.albedo(np.array([cosine]), n)[0]), 1))[:, None]
        assert found == pytest.approx(float((f * z / bound).mean() * 2 * np.pi), abs=6e-3)


def test_transmission_passes_the_bodys_part_straight_on(device: Device) -> None:
    """Below: (1 − F(wo·h))·color·transmission·D·G/(4 cos wo) and multiple scattering; above, the base has the rest."""
    solid, sheet = (
        MetallicRoughness(color=COLOR, roughness=0.6),
        MetallicRoughness(color=COLOR, roughness=0.6, transmission=0.7),
    )
    both = shown(device, solid, sheet, MetallicRoughness(color=(0.0,) * 3, roughness=0.6))
    scattered = lost(COS_O, 0.6) * lost(COS_I, 0.6) * COS_I / (np.pi * mean(lambda c: lost(c, 0.6)))
    below = ((1 - schlick(0.04, COS_H)) * ggx(0.36) + scattered)[:, None] * np.multiply(COLOR, 0.7)
    np.testing.assert_allclose(both.value(1, WO, WI * FLIP)[0], below, rtol=5e-4, atol=2e-4)
    upper = [both.value(which, WO, WI)[0] for which in (0, 1, 2)]
    check(upper[1], 0.3 * upper[0] + 0.7 * upper[2])
    assert not both.value(0, WO, WI * FLIP)[0].any()


def test_metal_passes_no_light_and_takes_none_from_what_does(device: Device) -> None:
    """At metallic 0.5 half as much is transmitted, by the Fresnel term of the dielectric part."""
    sheet, half = (
        MetallicRoughness(color=COLOR, roughness=0.6, transmission=0.7),
        MetallicRoughness(color=COLOR, roughness=0.6, transmission=0.7, metallic=0.5),
    )
    both = shown(device, sheet, half)
    check(both.value(1, WO, WI * FLIP)[0], 0.5 * both.value(0, WO, WI * FLIP)[0])


def test_specular_scales_f0_and_where_it_ends(device: Device) -> None:
    """F goes from min(f0·specular_color, 1)·specular to specular; f0 by ior. Metals are unaffected."""
    f0, f90 = (np.array([0.6, 1.0, 2.0]) / 9).clip(0, 1) * 0.4, 0.4  # ((2 − 1)/(2 + 1))² = 1/9
    black = shown(
        device,
        MetallicRoughness(color=(0.0,) * 3, roughness=0.6, ior=2.0, specular=0.4, specular_color=(0.6, 1.0, 2.0)),
    )
    fresnel = np.column_stack([schlick(f, COS_H, f90) for f in f0])
    check(black.value(0, WO, WI)[0], fresnel * ggx(0.36)[:, None])
    metals = shown(
        device,
        MetallicRoughness(color=COLOR, metallic=1.0),
        MetallicRoughness(color=COLOR, metallic=1.0, specular=0.1, specular_color=(0.0,) * 3),
    )
    check(metals.value(1, WO, WI)[0], metals.value(0, WO, WI)[0])


def test_beside_others_a_material_stays_as_it_was(device: Device) -> None:
    """Layers that a material lacks have no effect on it if other materials of its type have them."""
    plain = MetallicRoughness(color=COLOR, roughness=0.6)
    others = [
        MetallicRoughness(specular=0.1, specular_color=(0.2,) * 3),
        MetallicRoughness(clearcoat=1.0, sheen_color=(0.5,) * 3, transmission=0.5),
    ]
    alone, among = (bsdfs(device, [*materials]) for materials in ([plain], [plain, *others]))
    np.testing.assert_allclose(among.value(0, WO, WI)[0], alone.value(0, WO, WI)[0], rtol=1e-5, atol=1e-7)
    assert not among.value(0, WO, WI * FLIP)[0].any()


def test_who_has_no_layers_compiles_none(device: Device) -> None:
    def program(**fields: float) -> str:
        ball = Sphere(material=MetallicRoughness(**fields))  # type: ignore[arg-type]
        return compile_scene(Scene(spheres=[ball]), Choices(device.lanes)).source

    plain = program()
    assert "bsdf/layers.cl" not in plain and "clearcoat;" not in plain and "bsdf/sheen.cl" not in plain
    assert "bsdf/layers.cl" in program(clearcoat=1.0) and "bsdf/layers.cl" not in program(specular=0.5, ior=2.0)
    assert MetallicRoughness(ior=2.0).features() == MetallicRoughness().features()
