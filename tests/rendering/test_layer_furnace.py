"""White furnaces of what lies under coats and fibres, and of what lets light pass."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clrt.device.open import Device
from clrt.scene.materials import MetallicRoughness
from clrt.study.bsdfs import bsdfs
from clrt.study.furnace import SMITHS, evenly
from clrt.study.probe import Doubles
from clrt.study.scattering import ROUNDING, reciprocity

from .layers import Left, taken_from_gloss, under_coat, under_fibres

pytestmark = pytest.mark.statistics

SAMPLES = 1 << 15
WHITE: Any = (1.0, 1.0, 1.0)


def found(device: Device, materials: list[MetallicRoughness], cosines: Doubles) -> Doubles:
    """(materials, cosines): of the light from everywhere, what leaves at these angles."""
    whites, numbers = bsdfs(device, [*materials]), evenly(SAMPLES)
    views = [np.array([np.sqrt(1 - c * c), 0, c]) for c in cosines]
    return np.array([[whites.sample(which, wo, numbers)[1][:, 0].mean() for wo in views]
                     for which in range(len(materials))])


def test_white_loses_only_what_the_lesser_takes_from_gloss(device: Device) -> None:
    """1 − ∫ (T(wo) − min(T(wo), T(wi)))·gloss in float64, whatever the index, the metal, and both roughnesses."""
    rng, cosines, materials, lefts = np.random.default_rng(1), np.array([1.0, 0.7, 0.4, 0.2, 0.05]), [], list[Left]()
    for number in range(24):
        base: dict[str, Any] = {"color": WHITE, "roughness": rng.random(), "metallic": rng.choice([0, rng.random(), 1]),
                                "ior": 1 + 2 * rng.random()**2}
        strength, roughness = rng.choice([1, rng.random()]), rng.uniform(0.45, 1) if number % 2 else rng.random()
        materials.append(MetallicRoughness(**base, sheen_color=(strength,) * 3, sheen_roughness=roughness) if number % 2
                         else MetallicRoughness(**base, clearcoat=strength, clearcoat_roughness=roughness))
        lefts.append((under_fibres if number % 2 else under_coat)(strength, roughness))
    expected = [[1 - taken_from_gloss(left, cosine, material.lobes.alpha, material.lobes.f0[0]) for cosine in cosines]
                for material, left in zip(materials, lefts)]
    np.testing.assert_allclose(found(device, materials, cosines), expected, atol=2.5e-3)


def test_over_what_is_matte_or_smooth_coats_lose_nothing(device: Device) -> None:
    rng = np.random.default_rng(2)
    bases: list[dict[str, Any]] = [{"specular": 0.0}, {"metallic": 1.0, "roughness": 0.0}, {"roughness": 0.0}]
    coated = [MetallicRoughness(color=WHITE, **base, clearcoat=rng.choice([1, rng.random()]),
                                clearcoat_roughness=rng.random()) for base in bases for _ in range(6)]
    np.testing.assert_allclose(found(device, coated, np.array([1.0, 0.5, 0.1, 0.02])), 1, atol=2e-3)


def test_what_passes_light_keeps_all(device: Device) -> None:
    """By single bounces or more, whatever part of it is metal, by each form of masking."""
    rng = np.random.default_rng(3)
    sheets = [MetallicRoughness(color=WHITE, transmission=rng.choice([1, rng.random()]), roughness=rng.random(),
                                metallic=rng.choice([0, rng.random()]), ior=1 + 2 * rng.random(), smith=smith,
                                coupling="albedo", multiple_scattering=True) for smith in SMITHS for _ in range(8)]
    np.testing.assert_allclose(found(device, sheets, np.array([1.0, 0.5, 0.1, 0.02])), 1, atol=2.5e-3)


def everything(count: int) -> list[MetallicRoughness]:
    rng = np.random.default_rng(4)
    return [MetallicRoughness(color=WHITE, metallic=rng.random(), roughness=rng.random(), ior=1 + rng.random(),
                              clearcoat=rng.random(), clearcoat_roughness=rng.random(), sheen_color=(rng.random(),) * 3,
                              sheen_roughness=rng.uniform(0.4, 1), transmission=rng.random()) for _ in range(count)]


def test_all_layers_at_once_lose_little_and_make_no_light(device: Device) -> None:
    part = found(device, everything(24), np.array([1.0, 0.7, 0.4, 0.2, 0.05]))
    assert part.min() > 0.9 and part.max() < 1 + 2e-3


def test_layers_are_reciprocal(device: Device) -> None:
    materials = everything(12)
    subject = bsdfs(device, [*materials])
    for which, material in enumerate(materials):
        assert reciprocity(subject, which, 4000, which).max() < 5 * ROUNDING, material
