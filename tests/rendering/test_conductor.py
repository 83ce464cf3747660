"""Conductors by measured indices: Fresnel's equations in complex float64, and the presets' reflectance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import erf

from clrt.bench.kernel_probe import Doubles
from clrt.bench.numerics.bsdf_cases import bsdfs
from clrt.bench.numerics.scattering import above
from clrt.device.open import Device
from clrt.scene.materials.material_types import Conductor
from clrt.scene.materials.presets import CONDUCTORS, F0_PRESETS

from .ggx import masking

pytestmark = pytest.mark.statistics


def fresnel(cos_o: Doubles, n: complex) -> Doubles:
    """Return the unpolarized reflectance from the complex cosine of refraction (Born and Wolf, 1.5.2 and 14.2)."""
    cos_t = np.sqrt(1 - (1 - cos_o**2) / n**2)
    r_s = (cos_o - n * cos_t) / (cos_o + n * cos_t)
    r_p = (n * cos_o - cos_t) / (n * cos_o + cos_t)
    return np.asarray((abs(r_s) ** 2 + abs(r_p) ** 2) / 2)


EXTREMES = [((0.01, 1.0, 100.0), (5.0, 0.0, 100.0)), ((1.5, 0.01, 0.05), (0.0, 0.01, 20.0))]


@pytest.mark.parametrize("eta, k", [*CONDUCTORS.values(), *EXTREMES])
def test_it_is_fresnels_with_a_complex_index(device: Device, eta: tuple[float, ...], k: tuple[float, ...]) -> None:
    """eval = F·G·D/(4 cos wo) against the published formulas."""
    alpha = 0.6**2
    metal = bsdfs(device, [Conductor(eta=(eta[0], eta[1], eta[2]), k=(k[0], k[1], k[2]), roughness=0.6)])
    wo, wi = above(5000, 5), above(5000, 6)
    h = (wo + wi) / np.linalg.norm(wo + wi, axis=1, keepdims=True)
    tan2 = (1 - h[:, 2] ** 2) / h[:, 2] ** 2
    d = alpha**2 / (np.pi * h[:, 2] ** 4 * (alpha**2 + tan2) ** 2)
    f = np.column_stack([fresnel(np.sum(wo * h, axis=1), complex(*index)) for index in zip(eta, k)])
    expected = f * (d * masking("height_correlated", alpha, wo[:, 2], wi[:, 2]) / (4 * wo[:, 2]))[:, None]
    off = np.abs(metal.value(0, wo, wi)[0] - expected)
    roundings = 1e-5 / np.linalg.norm(wo + wi, axis=1, keepdims=True)
    assert np.all(off <= roundings * expected + 1e-6 * (d / wo[:, 2])[:, None])


@pytest.mark.parametrize("roughness", [0.1, 0.3, 0.6, 1.0])
def test_beckmann_is_as_published(device: Device, roughness: float) -> None:
    """D by its definition, and the exact Smith masking with the error function, which the rational one approximates."""
    alpha = roughness**2
    plain = Conductor(eta=(0.01,) * 3, k=(100.0,) * 3, roughness=roughness)
    tinted = replace(plain, distribution="beckmann", reflectance=(1.0, 0.5, 0.25))
    metal = bsdfs(device, [plain, replace(plain, distribution="beckmann"), tinted])
    wo, wi = above(5000, 5), above(5000, 6)
    h = (wo + wi) / np.linalg.norm(wo + wi, axis=1, keepdims=True)
    tan2 = (1 - h[:, 2] ** 2) / h[:, 2] ** 2
    d = np.exp(-tan2 / alpha**2) / (np.pi * alpha**2 * h[:, 2] ** 4)
    a = [w[:, 2] / (alpha * np.sqrt(1 - w[:, 2] ** 2)) for w in (wo, wi)]
    lambda_o, lambda_i = ((erf(each) - 1) / 2 + np.exp(-(each**2)) / (2 * np.sqrt(np.pi) * each) for each in a)
    expected = d / (1 + lambda_o + lambda_i) / (4 * wo[:, 2])
    found = metal.value(1, wo, wi)[0]
    np.testing.assert_allclose(found[:, 0], expected, rtol=0.01, atol=2e-4 * d.max())
    np.testing.assert_allclose(metal.value(2, wo, wi)[0], found * (1, 0.5, 0.25), rtol=1e-6, atol=1e-30)
    assert np.abs(metal.value(0, wo, wi)[0] - found).max() > 0.1 * found.max()


@pytest.mark.parametrize("name", sorted(set(CONDUCTORS) & set(F0_PRESETS)))
def test_presets_reflect_about_what_the_table_of_f0_says(name: str) -> None:
    """Suchiński's table 6.1 has sRGB values of whole spectra; one wavelength per channel comes within 0.12 of them."""
    found = [float(fresnel(np.array([1.0]), complex(*index))[0]) for index in zip(*CONDUCTORS[name])]
    assert np.abs(np.subtract(found, F0_PRESETS[name][0])).max() < 0.12
