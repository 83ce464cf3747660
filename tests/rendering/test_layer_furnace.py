"""White furnace tests of layered and transmissive materials."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from clrt.bench.kernel_probe import Doubles
from clrt.bench.numerics.bsdf_cases import bsdfs
from clrt.bench.numerics.furnace import SMITHS, evenly
from clrt.bench.numerics.scattering import ROUNDING, reciprocity
from clrt.device.open import Device
from clrt.scene.materials.material_types import MetallicRoughness
from clrt.scene.materials.textures import Picture, Texture

from ..oracle.scenes import todays_seed

pytestmark = pytest.mark.statistics

SAMPLES = 1 << 15
WHITE: Any = (1.0, 1.0, 1.0)


def found(device: Device, materials: list[MetallicRoughness], cosines: Doubles) -> Doubles:
    """Return the reflectance in a white furnace, (materials, cosines)."""
    whites, numbers = bsdfs(device, [*materials]), evenly(SAMPLES)
    views = [np.array([np.sqrt(1 - c * c), 0, c]) for c in cosines]
    return np.array(
        [[whites.sample(which, wo, numbers)[1][:, 0].mean() for wo in views] for which in range(len(materials))]
    )


def drawn(rng: np.random.Generator, **fields: Any) -> MetallicRoughness:
    """Return a random white material below a coat, sheen, or both."""
    covers = [
        {"clearcoat": rng.choice([1, rng.random()]), "clearcoat_roughness": rng.random()},
        {"sheen_color": (rng.choice([1, rng.random()]),) * 3, "sheen_roughness": rng.random()},
    ]
    kind = rng.integers(3)
    covered: dict[str, Any] = covers[0] | covers[1] if kind == 2 else covers[kind]
    return MetallicRoughness(
        color=WHITE,
        roughness=rng.random(),
        metallic=rng.choice([0, rng.random(), 1]),
        ior=1 + 2 * rng.random() ** 2,
        **fields,
        **covered,
    )


def test_white_under_layers_keeps_all(device: Device) -> None:
    """For any index, metallic, transmission, masking form and roughness."""
    seed = todays_seed()
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    materials = [
        drawn(rng, transmission=rng.choice([0, rng.random()]), smith=smith, coupling="albedo", multiple_scattering=True)
        for smith in SMITHS
        for _ in range(12)
    ]
    part = found(device, materials, np.array([1.0, 0.7, 0.4, 0.2, 0.05]))
    np.testing.assert_allclose(part, 1, atol=2.5e-3)


def test_roughnesses_of_textures_lose_little(device: Device) -> None:
    """Textured roughness is interpolated linearly between table rows."""
    rng = np.random.default_rng(5)

    def textured(roughness: float | Texture) -> Texture:
        assert isinstance(roughness, float)
        return Texture(
            picture=Picture(np.full((1, 1, 4), round(255 * roughness), np.uint8)), channel="alpha", filter="nearest"
        )

    mapped = [
        replace(
            m,
            roughness=textured(m.roughness),
            sheen_roughness=textured(m.sheen_roughness),
            clearcoat_roughness=textured(m.clearcoat_roughness),
        )
        for m in (drawn(rng) for _ in range(24))
    ]
    part = found(device, mapped, np.array([1.0, 0.7, 0.4, 0.2, 0.05]))
    assert np.abs(part - 1).max() < 0.02 and np.abs(part - 1).mean() < 2e-3


def test_what_passes_light_keeps_all(device: Device) -> None:
    """With one or more bounces, any metallic and each masking form."""
    rng = np.random.default_rng(3)
    sheets = [
        MetallicRoughness(
            color=WHITE,
            transmission=rng.choice([1, rng.random()]),
            roughness=rng.random(),
            metallic=rng.choice([0, rng.random()]),
            ior=1 + 2 * rng.random(),
            smith=smith,
            coupling="albedo",
            multiple_scattering=True,
        )
        for smith in SMITHS
        for _ in range(8)
    ]
    np.testing.assert_allclose(found(device, sheets, np.array([1.0, 0.5, 0.1, 0.02])), 1, atol=2.5e-3)


def test_layers_are_reciprocal(device: Device) -> None:
    rng = np.random.default_rng(4)
    materials = [drawn(rng, transmission=rng.random()) for _ in range(12)]
    subject = bsdfs(device, [*materials])
    for which, material in enumerate(materials):
        assert reciprocity(subject, which, 4000, which).max() < 5 * ROUNDING, material
