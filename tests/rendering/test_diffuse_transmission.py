"""Diffuse transmission (KHR_materials_diffuse_transmission): closed forms, energy, and lights on both sides."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clrt.bench.numerics.bsdf_cases import bsdfs
from clrt.bench.numerics.furnace import evenly
from clrt.bench.numerics.scattering import above
from clrt.device.open import Device
from clrt.errors import SceneError
from clrt.scene.lights import DirectionalLight
from clrt.scene.materials.material_types import MetallicRoughness
from clrt.scene.model import Camera, RenderSettings, Scene

from .pictures import film, quad

pytestmark = pytest.mark.statistics

WHITE = (1.0, 1.0, 1.0)
COLOR, GREEN = (0.5, 0.4, 0.3), (0.2, 0.7, 0.1)
#: Without gloss both lobes are Lambert's.
LEAF = MetallicRoughness(color=COLOR, specular=0.0, diffuse_transmission=0.6, diffuse_transmission_color=GREEN)


def test_lambert_on_both_sides(device: Device) -> None:
    leaf, wo, wi = bsdfs(device, [LEAF]), above(500, 1), above(500, 2)
    reflected = 0.4 * np.array(COLOR) * wi[:, 2:] / np.pi
    np.testing.assert_allclose(leaf.value(0, wo, wi)[0], reflected, rtol=1e-3, atol=1e-6)
    passed = 0.6 * np.array(GREEN) * wi[:, 2:] / np.pi
    np.testing.assert_allclose(leaf.value(0, wo, wi * [1, 1, -1])[0], passed, rtol=1e-3, atol=1e-6)


def test_white_reflects_or_transmits_all(device: Device) -> None:
    """With gloss, next to metal and to transmission by microfacets, and below layers."""
    layers: list[dict[str, Any]] = [
        {},
        {"transmission": 0.5},
        {"clearcoat": 1.0},
        {"sheen_color": (0.5, 0.5, 0.5), "sheen_roughness": 0.3, "clearcoat": 0.5},
        {"anisotropy": 0.6},
    ]
    materials: list[Any] = [
        MetallicRoughness(color=WHITE, metallic=metallic, roughness=roughness, diffuse_transmission=part, **layer)
        for layer in layers
        for metallic in (0.0, 0.5)
        for roughness, part in ((0.1, 1.0), (0.6, 0.4))
    ]
    whites, numbers = bsdfs(device, materials), evenly(1 << 13)
    for which, material in enumerate(materials):
        for cosine in (1.0, 0.6, 0.2, 0.05):
            wo = np.array([np.sqrt(1 - cosine**2), 0, cosine])
            found = whites.sample(which, wo, numbers)[1].mean(axis=0)
            np.testing.assert_allclose(found, 1, atol=3e-3, err_msg=f"{material} at {cosine}")


@pytest.mark.parametrize("behind", [False, True])
def test_lights_on_both_sides(device: Device, behind: bool) -> None:
    """Radiance = albedo·E·cos/π from either side of a leaf."""
    up = -0.8 if behind else 0.8
    scene = Scene(
        meshes=[quad([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], LEAF)],
        lights=[DirectionalLight(direction=(0.6, 0.0, -up), irradiance=(3.0, 3.0, 3.0))],
        camera=Camera(position=(0.5, 0.5, 5.0), look_at=(0.0, 0.0, 0.0), fov_degrees=0.1),
        render=RenderSettings(size=(1, 1), spp=16, integrator="direct"),
    )
    albedo = 0.6 * np.array(GREEN) if behind else 0.4 * np.array(COLOR)
    np.testing.assert_allclose(film(device, scene).mean[0, 0], albedo * 3 * 0.8 / np.pi, rtol=1e-3)


def test_other_couplings_are_refused() -> None:
    with pytest.raises(SceneError, match='diffuse_transmission: is for coupling = "albedo"; write that'):
        MetallicRoughness(diffuse_transmission=1.0, coupling="fresnel")
