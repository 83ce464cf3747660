"""Dispersion of smooth glass (KHR_materials_dispersion): Snell's and Fresnel's laws per channel, energy, and noise."""

from __future__ import annotations

import numpy as np
import pytest

from clrt.bench.numerics.bsdf_cases import bsdfs, uniform
from clrt.device.open import Device
from clrt.errors import SceneError
from clrt.scene.materials.dielectric_energy import fresnel_dielectric
from clrt.scene.materials.material_types import Dielectric
from clrt.scene.model import Camera, Environment, RenderSettings, Scene, Sphere

from .pictures import film

pytestmark = pytest.mark.statistics

IOR, DISPERSION = 1.5, 3.0
#: The extension's three indices.
IORS = IOR + np.array([-1, 0, 1]) * (IOR - 1) * 0.025 * DISPERSION
COLOR = (0.9, 0.8, 0.7)
GLASS = Dielectric(ior=IOR, dispersion=DISPERSION, color=COLOR)


@pytest.mark.parametrize("front", [True, False])
@pytest.mark.parametrize("cosine", [1.0, 0.7453, 0.3])
def test_each_channel_follows_snells_and_fresnels_laws(device: Device, front: bool, cosine: float) -> None:
    """The mean light of each channel along its refracted direction is color·(1 − F), and along the mirrored one F; from
    inside at a cosine of 0.7453 red is still refracted, and the others are totally reflected."""
    count = 1 << 14
    sine = np.sqrt(1 - cosine**2)
    wi, weight, pdf, specular = bsdfs(device, [GLASS]).sample(
        0, np.array([sine, 0, cosine]), uniform(count, 3), front=front
    )
    assert specular.all() and (pdf > 0).all()
    etas = IORS if front else 1 / IORS
    up = wi[:, 2] > 0
    np.testing.assert_allclose(wi[up], np.tile([-sine, 0, cosine], (up.sum(), 1)), atol=1e-6)
    for channel, eta in enumerate(etas):
        fresnel, cos_t = (float(part) for part in fresnel_dielectric(np.array(cosine), float(eta)))
        assert weight[up, channel].sum() / count == pytest.approx(fresnel, abs=0.015)
        own = ~up & (weight[:, channel] > 0)
        assert weight[own, channel].sum() / count == pytest.approx(COLOR[channel] * (1 - fresnel), abs=0.04)
        np.testing.assert_allclose(wi[own], np.tile([-sine / eta, 0, -cos_t], (own.sum(), 1)), atol=2e-4)
        assert not np.delete(weight[own], channel, axis=1).any()


def test_a_ball_in_a_furnace(device: Device) -> None:
    """A ball that absorbs nothing is invisible in even light; a path separates once, so no sample exceeds 3."""
    scene = Scene(
        spheres=[Sphere(material=Dielectric(ior=IOR, dispersion=DISPERSION))],
        environment=Environment(color=(1.0, 1.0, 1.0)),
        camera=Camera(position=(0.0, 0.0, 4.0), look_at=(0.0, 0.0, 0.0), fov_degrees=24.0),
        render=RenderSettings(size=(8, 8), spp=4096, max_depth=64),
    )
    found = film(device, scene)
    assert found.mean.mean(axis=(0, 1)) == pytest.approx([1, 1, 1], abs=0.01)
    squares = (found.pixels["square"] / found.pixels["count"][..., None]).mean(axis=(0, 1))
    assert (squares > 1.5).all() and (squares < 3.05).all()


@pytest.mark.parametrize("fields", [{"roughness": 0.2}, {"thin": True}])
def test_only_smooth_solids_disperse(fields: dict[str, float]) -> None:
    with pytest.raises(SceneError, match="dispersion: is for solid glass with roughness = 0"):
        Dielectric(dispersion=1.0, **fields)  # type: ignore[arg-type]
