"""Thin films on metallic_roughness: the formulas of KHR_materials_iridescence, exact interference, and energy."""

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
from clrt.scene.materials.material_types import MetallicRoughness
from clrt.scene.model import Scene, Sphere
from clrt.scene.validation.validate import validate

from .ggx import masking

pytestmark = pytest.mark.statistics

Doubles = NDArray[np.float64]
WHITE = (1.0, 1.0, 1.0)
TO_RGB = np.array(
    [[3.2404542, -1.5371385, -0.4985314], [-0.9692660, 1.8760108, 0.0415560], [0.0556434, -0.2040259, 1.0572252]]
)


def schlick(f0: Doubles, cosine: Doubles) -> Doubles:
    return np.asarray(f0 + (1 - f0) * (1 - cosine) ** 5)


def sensitivity(path: Doubles, shift: Doubles) -> Doubles:
    """Return the extension's evalSensitivity, (n, 3); path (n, 1) in nm, shift (3,)."""
    phase = 2 * np.pi * path * 1e-9
    size, place = np.array([5.4856e-13, 4.4201e-13, 5.2481e-13]), np.array([1.6810e6, 1.7953e6, 2.2084e6])
    spread = np.array([4.3278e9, 9.3046e9, 6.6121e9])
    xyz = size * np.sqrt(2 * np.pi * spread) * np.cos(place * phase + shift) * np.exp(-(phase**2) * spread)
    further = 9.7470e-14 * np.sqrt(2 * np.pi * 4.5282e9) * np.cos(2.2399e6 * phase + shift[0])
    xyz[:, :1] += further * np.exp(-4.5282e9 * phase**2)
    return np.asarray(xyz / 1.0685e-7 @ TO_RGB.T)


def film_fresnel(f0: Doubles, ior: float, thickness: float, cosine: Doubles) -> Doubles:
    """Return the extension's F_iridescence (n, 3) of a film in air, for cosines (n,), between 0 and 1.

    The path in the film is that of its own angle, as in Belcour and Barla's paper.
    """
    cosine = cosine[:, None]
    cosine2 = np.sqrt(1 - (1 - cosine**2) / ior**2)
    r12 = schlick(np.array(((ior - 1) / (ior + 1)) ** 2), cosine)
    root = np.sqrt(np.minimum(f0, 0.9999))
    base = (1 + root) / (1 - root)
    r23 = schlick(((base - ior) / (base + ior)) ** 2, cosine2)
    shift = np.pi + np.where(base < ior, np.pi, 0)
    both = np.clip(r12 * r23, 1e-5, 0.9999)
    returned = (1 - r12) ** 2 * r23 / (1 - both)
    found, term = r12 + returned, returned - (1 - r12)
    for m in (1, 2):
        term = term * np.sqrt(both)
        found = found + term * 2 * sensitivity(m * 2 * ior * thickness * cosine2, m * shift)
    return np.clip(found, 0, 1)


FILMS = [(1.3, 400.0), (1.3, 1200.0), (1.8, 250.0), (2.2, 700.0), (1.0, 300.0)]


@pytest.mark.parametrize("metallic", [0.0, 1.0])
def test_formulas_of_the_extension(device: Device, metallic: float) -> None:
    """The gloss of the surface, times D·G/(4·cos): that of a metal, or of a black dielectric."""
    color, roughness, strength = (0.9, 0.6, 0.2), 0.4, 0.75
    materials: list[Any] = [
        MetallicRoughness(
            color=color if metallic else (0.0, 0.0, 0.0),
            metallic=metallic,
            roughness=roughness,
            multiple_scattering=False,
            coupling="albedo",
            iridescence=strength,
            iridescence_ior=ior,
            iridescence_thickness=thickness,
        )
        for ior, thickness in FILMS
    ]
    found, wo, wi = bsdfs(device, materials), above(2000, 1), above(2000, 2)
    h = (wo + wi) / np.linalg.norm(wo + wi, axis=1, keepdims=True)
    alpha, cosine = roughness**2, np.sum(wo * h, axis=1)
    d = alpha**2 / (np.pi * (h[:, 2] ** 2 * (alpha**2 - 1) + 1) ** 2)
    gloss = d * masking("height_correlated", alpha, wo[:, 2], wi[:, 2]) / (4 * wo[:, 2])
    f0 = np.array(color) if metallic else np.full(3, 0.04)
    for which, (ior, thickness) in enumerate(FILMS):
        plain, film = schlick(f0, cosine[:, None]), film_fresnel(f0, ior, thickness, cosine)
        expected = (plain + strength * (film - plain)) * gloss[:, None]
        np.testing.assert_allclose(found.value(which, wo, wi)[0], expected, rtol=2e-3, atol=2e-5)


def test_the_series_is_interference(device: Device) -> None:
    """Airy's sum over all wavelengths at normal incidence, with Gaussians of the extension as color matching; the mean
    over the phase is white. Its first two terms are all that matters if little is reflected at both sides."""
    ior, thickness = 1.3, 500.0
    film = MetallicRoughness(
        color=(0.0, 0.0, 0.0),
        roughness=0.3,
        multiple_scattering=False,
        coupling="albedo",
        iridescence=1.0,
        iridescence_ior=ior,
        iridescence_thickness=thickness,
    )
    up = np.array([[0.0, 0.0, 1.0]])
    value = bsdfs(device, [film]).value(0, up, up)[0][0] * (4 * np.pi * 0.3**4)
    k = np.linspace(1e6, 3e6, 4001)
    size, place = np.array([5.4856e-13, 4.4201e-13, 5.2481e-13, 9.7470e-14]), [1.6810e6, 1.7953e6, 2.2084e6, 2.2399e6]
    spread = np.array([4.3278e9, 9.3046e9, 6.6121e9, 4.5282e9])
    # Their Fourier transforms are size·√(2π·spread)·exp(−phase²·spread), as the extension has them.
    curves = size / np.sqrt(2) * np.exp(-((k[:, None] - place) ** 2) / (4 * spread))
    curves = np.column_stack([curves[:, 0] + curves[:, 3], curves[:, 1], curves[:, 2]])
    outer, base = (1 - ior) / (1 + ior), (ior - 1.5) / (ior + 1.5)
    # The extension's phase is 2π·path·wavenumber, with wavenumbers in 1/m.
    turn = np.exp(2j * np.pi * 2 * ior * thickness * 1e-9 * k)
    reflected = np.abs((outer + base * turn) / (1 + outer * base * turn)) ** 2
    mean = outer**2 + (1 - outer**2) ** 2 * base**2 / (1 - outer**2 * base**2)
    expected = mean + TO_RGB @ ((reflected - mean) @ curves * (k[1] - k[0]) / 1.0685e-7)
    np.testing.assert_allclose(value, expected, atol=2e-3)


def test_no_light_is_made(device: Device) -> None:
    """White below films: of any index and thickness, dielectric, metal, transmissive, and below a coat."""
    rng = np.random.default_rng(7)
    layers: list[dict[str, Any]] = [{}, {"transmission": 0.5}, {"clearcoat": 1.0}]
    materials: list[Any] = [
        MetallicRoughness(
            color=WHITE,
            metallic=float(rng.choice([0, 0, 1, rng.random()])),
            roughness=float(rng.choice([0.05, 0.3, rng.random()])),
            ior=float(rng.uniform(1, 2.5)),
            iridescence=float(rng.choice([1, rng.random()])),
            iridescence_ior=float(rng.uniform(1, 2.5)),
            iridescence_thickness=float(rng.uniform(0, 1200)),
            **layers[number % 3],
        )
        for number in range(60)
    ]
    whites, numbers = bsdfs(device, materials), evenly(1 << 13)
    for which, material in enumerate(materials):
        for cosine in (1.0, 0.8, 0.6, 0.4, 0.2, 0.05):
            wo = np.array([np.sqrt(1 - cosine**2), 0, cosine])
            found = whites.sample(which, wo, numbers)[1].mean(axis=0)
            assert (found < 1.003).all(), (material, cosine, found)


@pytest.mark.parametrize("ior", [1.3, 1.8])
def test_little_light_is_lost(device: Device, ior: float) -> None:
    """On plastic, what the film reflects less than at its brightest angle, and near the horizon than a smooth one."""
    films: list[Any] = [
        MetallicRoughness(
            color=WHITE,
            roughness=roughness,
            iridescence=1.0,
            iridescence_ior=ior,
            iridescence_thickness=thickness,
        )
        for thickness in (150.0, 300.0, 500.0, 1000.0)
        for roughness in (0.1, 0.5)
    ]
    whites, numbers = bsdfs(device, films), evenly(1 << 13)
    for which, material in enumerate(films):
        for cosine in (1.0, 0.6, 0.3):
            wo = np.array([np.sqrt(1 - cosine**2), 0, cosine])
            found = whites.sample(which, wo, numbers)[1].mean()
            assert found > (0.85 if ior == 1.3 else 0.78), (material, cosine, found)


def test_other_couplings_are_refused() -> None:
    with pytest.raises(SceneError, match='iridescence: is for coupling = "albedo"; write that'):
        validate(Scene(spheres=[Sphere(material=MetallicRoughness(iridescence=1.0, coupling="fresnel"))]))
