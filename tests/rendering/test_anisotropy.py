"""Anisotropic metallic_roughness: the formulas of KHR_materials_anisotropy, its axes on surfaces, and its energy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.bench.numerics.bsdf_cases import bsdfs
from clrt.bench.numerics.furnace import evenly
from clrt.bench.numerics.scattering import above
from clrt.device.open import Device
from clrt.errors import SceneError
from clrt.scene.lights import DirectionalLight
from clrt.scene.materials import anisotropy_energy
from clrt.scene.materials.material_types import Conductor, MetallicRoughness
from clrt.scene.materials.textures import Channel, Picture, Texture
from clrt.scene.model import Camera, Mesh, RenderSettings, Scene

from .pictures import film

pytestmark = pytest.mark.statistics

Doubles = NDArray[np.float64]
WHITE = (1.0, 1.0, 1.0)
GOLD = (1.0, 0.7, 0.3)


def specular(
    roughness: float, strength: float, t: Doubles, b: Doubles, n: Doubles, v: Doubles, light: Doubles
) -> Doubles:
    """Return the extension's specular_brdf without Fresnel: its D_GGX and V_GGX with tangent t and bitangent b."""
    at, ab = roughness**2 + (1 - roughness**2) * strength**2, roughness**2
    h = (v + light) / np.linalg.norm(v + light, axis=-1, keepdims=True)
    f2 = (ab * (h @ t)) ** 2 + (at * (h @ b)) ** 2 + (at * ab * (h @ n)) ** 2
    w2 = at * ab / f2
    d = at * ab * w2 * w2 / np.pi
    by_view, by_light = (
        (a @ n) * np.sqrt((at * (c @ t)) ** 2 + (ab * (c @ b)) ** 2 + (c @ n) ** 2) for a, c in ((light, v), (v, light))
    )
    return np.asarray(d * 0.5 / (by_view + by_light))


def axes(degrees: float) -> tuple[Doubles, Doubles, Doubles]:
    """Return tangent, bitangent and normal in the local frame."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([c, s, 0]), np.array([-s, c, 0]), np.array([0.0, 0, 1])


@pytest.mark.parametrize("degrees", [0.0, 35.0, -100.0])
def test_formulas_of_the_extension(device: Device, degrees: float) -> None:
    """Of metal with single scattering, with Schlick's Fresnel, for several roughnesses and strengths."""
    pairs = [(0.2, 0.3), (0.5, 0.7), (0.4, 1.0), (0.9, 0.5)]
    metals: list[Any] = [
        MetallicRoughness(
            color=GOLD,
            metallic=1.0,
            roughness=roughness,
            anisotropy=strength,
            anisotropy_degrees=degrees,
            multiple_scattering=False,
        )
        for roughness, strength in pairs
    ]
    found, wo, wi = bsdfs(device, metals), above(2000, 1), above(2000, 2)
    h = (wo + wi) / np.linalg.norm(wo + wi, axis=1, keepdims=True)
    fresnel = np.array(GOLD) + (1 - np.array(GOLD)) * (1 - np.sum(wo * h, axis=1, keepdims=True)) ** 5
    for which, (roughness, strength) in enumerate(pairs):
        expected = fresnel * (specular(roughness, strength, *axes(degrees), wo, wi) * wi[:, 2])[:, None]
        np.testing.assert_allclose(found.value(which, wo, wi)[0], expected, rtol=2e-4, atol=1e-6)


def test_strength_0_is_isotropic(device: Device) -> None:
    """Also next to anisotropic materials, and from a texture."""
    black = Texture(picture=Picture(np.zeros((1, 1, 4), np.uint8)))
    plain = MetallicRoughness(color=GOLD, metallic=0.5, roughness=0.4)
    textured = MetallicRoughness(color=GOLD, metallic=0.5, roughness=0.4, anisotropy=black)
    found = bsdfs(device, [plain, textured, MetallicRoughness(anisotropy=1.0)])
    wo, wi = above(500, 3), above(500, 4)
    np.testing.assert_allclose(found.value(1, wo, wi)[0], found.value(0, wo, wi)[0], rtol=1e-5)


@pytest.mark.parametrize("textured", [False, True])
@pytest.mark.parametrize("metallic", [0.0, 1.0])
def test_white_reflects_all(device: Device, metallic: float, textured: bool) -> None:
    """From every azimuth: up to the interpolation of the tables, which for textures is coarser."""
    pairs = [(0.1, 0.2), (0.1, 1.0), (0.4, 0.6), (0.7, 0.9)]

    def value(number: float, channel: Channel) -> float | Texture:
        texels = np.full((1, 1, 4), round(255 * number), np.uint8)
        return Texture(picture=Picture(texels), channel=channel) if textured else number

    materials: list[Any] = [
        MetallicRoughness(
            color=WHITE, metallic=metallic, roughness=value(roughness, "green"), anisotropy=value(strength, "blue")
        )
        for roughness, strength in pairs
    ]
    whites, numbers = bsdfs(device, materials), evenly(1 << 14)
    for which, pair in enumerate(pairs):
        for cosine in (1.0, 0.6, 0.2, 0.05):
            for azimuth in (0.0, 0.8, np.pi / 2):
                sine = np.sqrt(1 - cosine**2)
                wo = np.array([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine])
                found = whites.sample(which, wo, numbers)[1].mean(axis=0)
                most = 1.2e-2 if textured else 2e-3
                np.testing.assert_allclose(found, 1, atol=most, err_msg=f"{pair} at {cosine}, {azimuth}")


def test_layers_above_lose_light_but_make_none(device: Device) -> None:
    """What the layers remove from the gloss beyond their own reflection is lost, at most a tenth of the light."""
    layers: list[dict[str, Any]] = [
        {"clearcoat": 1.0},
        {"clearcoat": 1.0, "clearcoat_roughness": 0.5},
        {"sheen_color": (0.8, 0.8, 0.8), "sheen_roughness": 0.5},
    ]
    materials: list[Any] = [
        MetallicRoughness(color=WHITE, metallic=metallic, roughness=roughness, anisotropy=strength, **layer)
        for metallic in (0.0, 1.0)
        for roughness, strength in ((0.1, 0.3), (0.1, 1.0), (0.5, 0.8))
        for layer in layers
    ]
    whites, numbers = bsdfs(device, materials), evenly(1 << 13)
    for which, material in enumerate(materials):
        for wo in ([0.0, 0, 1], [0.8, 0, 0.6], [0, 0.98, 0.199], [0.98, 0, 0.199]):
            found = whites.sample(which, np.array(wo), numbers)[1].mean()
            assert 0.9 < found < 1.002, (material, wo, found)


def brute_force(cosine: float, azimuth: float, alpha_t: float, alpha_b: float) -> tuple[float, float]:
    """Return lost and by_f90 by quadrature over half vectors, uniform in the slopes' distribution."""
    count = 1500
    u = (np.arange(count) + 0.5) / count
    r = np.sqrt(u / (1 - u))  # of the slopes' distribution, whose integral is r²/(1 + r²)
    turn = 2 * np.pi * u
    x, y = alpha_t * r[:, None] * np.cos(turn), alpha_b * r[:, None] * np.sin(turn)
    h = np.stack([x, y, np.ones_like(x)]) / np.sqrt(1 + x * x + y * y)
    sine = np.sqrt(1 - cosine**2)
    wo = np.array([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine])
    along = np.maximum(np.tensordot(wo, h, 1), 0)
    wi = 2 * along * h - wo[:, None, None]
    root = [np.sqrt((alpha_t * w[0]) ** 2 + (alpha_b * w[1]) ** 2 + w[2] ** 2) for w in (wo, wi)]
    # G2·D·(wo·h)/cos wo dωh, D·cos h dωh = the measure of slopes
    up = np.maximum(wi[2], 0)
    masking = 2 * cosine * up / (cosine * root[1] + up * root[0])
    part = masking * along / (cosine * h[2]) / count**2
    return 1 - float(part.sum()), float(np.sum(part * (1 - along) ** 5))


@pytest.mark.parametrize("roughness, strength", [(0.3, 0.2), (0.3, 0.8), (0.8, 1.0)])
def test_tables_hold_the_albedo(roughness: float, strength: float) -> None:
    alpha_t, alpha_b = anisotropy_energy.alphas(roughness, strength)
    row = anisotropy_energy.tables(roughness, strength)
    cells = np.array(row).reshape(-1, 8)[1:].reshape(anisotropy_energy.STEPS, anisotropy_energy.AZIMUTHS, 2, 2, 2)
    values = np.zeros((anisotropy_energy.STEPS + 1, anisotropy_energy.AZIMUTHS + 1, 2))
    for i in (0, 1):
        for j in (0, 1):
            values[i : anisotropy_energy.STEPS + i, j : anisotropy_energy.AZIMUTHS + j] = cells[:, :, :, i, j]
    for cosine in (0.9, 0.5, 0.1):
        for azimuth in (0.0, 0.7, 1.5):
            place = np.array([cosine]), np.array([azimuth])
            (lost,), (by_f90,) = anisotropy_energy.interpolated(values, *place, alpha_t, alpha_b)
            expected = brute_force(cosine, azimuth, alpha_t, alpha_b)
            assert (lost, by_f90) == pytest.approx(expected, abs=3e-3), (cosine, azimuth)


def lit(device: Device, mesh: Mesh, eye: tuple[float, float, float], towards: tuple[float, float, float]) -> Doubles:
    """Return the radiance of the middle of a picture of the mesh in a directional light of irradiance 1."""
    x, y, z = towards
    scene = Scene(
        meshes=[mesh],
        lights=[DirectionalLight(direction=(-x, -y, -z), irradiance=WHITE)],
        camera=Camera(position=eye, look_at=(0.0, 0.0, 0.0), up=(0.0, 0.0, -1.0), fov_degrees=0.1),
        render=RenderSettings(size=(1, 1), spp=16, integrator="direct"),
    )
    return np.asarray(film(device, scene).mean[0, 0])


SQUARE = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
UV = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)  # v points down in the image


@pytest.mark.parametrize("how", ["plain", "behind", "mirrored", "turned", "map", "tangents"])
def test_axes_on_a_surface(device: Device, how: str) -> None:
    """The axis is the direction of u, turned counter-clockwise seen from the front of the image; from behind it stays
    where it is, and if the image is mirrored it turns the other way."""
    degrees, strength, roughness = 30.0, 0.8, 0.3
    texture = Texture(picture=Picture(np.array([[[128, 255, 204, 255]]], np.uint8)), channel="blue")
    metal = MetallicRoughness(
        color=WHITE,
        metallic=1.0,
        roughness=roughness,
        anisotropy=texture if how == "map" else strength,
        anisotropy_degrees=degrees,
        anisotropy_map=texture if how == "map" else None,
        multiple_scattering=False,
    )
    mesh = Mesh(SQUARE, np.array([[0, 1, 2], [0, 2, 3]], np.int32), metal, uv=UV)
    along = {"mirrored": 180 - degrees, "turned": 90 + degrees, "map": 90 + degrees, "tangents": 90 + degrees}
    if how == "mirrored":
        mesh.uv = UV * np.array([-1, 1], np.float32)
    elif how == "turned":
        mesh.uv = np.roll(UV, 1, axis=0)
    elif how == "tangents":
        mesh.tangents = np.tile(np.array([0, 1, 0, 1], np.float32), (4, 1))
    side = -1.0 if how == "behind" else 1.0
    t, b, n = axes(along.get(how, degrees))
    v, light = np.array([0.3, 0.5, side]), np.array([0.4, -0.2, side])
    v, light = v / np.linalg.norm(v), light / np.linalg.norm(light)
    found = lit(device, mesh, tuple(5 * v), tuple(light))
    expected = specular(roughness, strength, t, b, side * n, v, light) * abs(light[2])
    np.testing.assert_allclose(found, expected, rtol=4e-3)


def test_surfaces_without_coordinates_are_isotropic(device: Device) -> None:
    metal = MetallicRoughness(color=WHITE, metallic=1.0, roughness=0.3, anisotropy=0.8, multiple_scattering=False)
    mesh = Mesh(SQUARE, np.array([[0, 1, 2], [0, 2, 3]], np.int32), metal)
    light = np.array([0.4, -0.2, 1.0]) / np.sqrt(1.2)
    found = lit(device, mesh, (0.0, 0.5, 5.0), tuple(light))
    v = np.array([0.0, 0.5, 5.0]) / np.sqrt(25.25)
    np.testing.assert_allclose(found, specular(0.3, 0.0, *axes(0), v, light) * light[2], rtol=4e-3)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_brushed_conductors(device: Device, side: float, turned: bool) -> None:
    """`roughness` is along u, `roughness_across` across it; without coordinates alpha is their geometric mean."""
    metal = Conductor(eta=(0.01,) * 3, k=(100.0,) * 3, roughness=0.6, roughness_across=0.3)
    strength = np.sqrt((0.6**2 - 0.3**2) / (1 - 0.3**2))
    v, light = np.array([0.3, 0.5, side]), np.array([0.4, -0.2, side])
    v, light = v / np.linalg.norm(v), light / np.linalg.norm(light)
    uv = np.roll(UV, 1, axis=0) if turned else UV
    found = lit(
        device, Mesh(SQUARE, np.array([[0, 1, 2], [0, 2, 3]], np.int32), metal, uv=uv), tuple(5 * v), tuple(light)
    )
    t, b, n = axes(90 if turned else 0)
    expected = specular(0.3, strength, t, b, side * n, v, light) * abs(light[2])
    np.testing.assert_allclose(found, expected, rtol=4e-3)
    found = lit(device, Mesh(SQUARE, np.array([[0, 1, 2], [0, 2, 3]], np.int32), metal), tuple(5 * v), tuple(light))
    expected = specular(np.sqrt(0.3 * 0.6), 0.0, t, b, side * n, v, light) * abs(light[2])
    np.testing.assert_allclose(found, expected, rtol=4e-3)


def test_a_texture_of_the_roughness_across(device: Device) -> None:
    """Equal to the number that it stands for; and equal roughnesses are isotropic, next to others as well."""
    texture = Texture(picture=Picture(np.full((1, 1, 4), 153, np.uint8)))
    given: list[Any] = [Conductor(roughness_across=across) for across in (0.6, texture, 0.3, None)]
    assert given[1].without_textures().roughness_across == 1.0
    found, wo, wi = bsdfs(device, given), above(500, 3), above(500, 4)
    number, textured, even, plain = (found.value(which, wo, wi)[0] for which in range(4))
    np.testing.assert_allclose(textured, number, rtol=1e-5)
    np.testing.assert_allclose(even, plain, rtol=1e-5)
    assert np.abs(number / plain - 1).max() > 0.1


def test_other_masking_terms_are_refused() -> None:
    with pytest.raises(SceneError, match='anisotropy: is for smith = "height_correlated"; leave smith out'):
        MetallicRoughness(anisotropy=0.5, smith="schlick")
