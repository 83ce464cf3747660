"""Glass: Fresnel's and Snell's laws in float64, and scenes with known results."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clrt.bench.kernel_probe import Doubles
from clrt.bench.numerics.bsdf_cases import bsdfs
from clrt.device.open import Device
from clrt.scene.materials.material_types import Dielectric, Diffuse
from clrt.scene.model import Camera, Environment, RenderSettings, Scene, Sphere

from .pictures import film, quad

pytestmark = pytest.mark.statistics

SKY = Environment(color=(1.0, 1.0, 1.0))


def fresnel(cos_o: Doubles, eta: float) -> Doubles:
    """Return the unpolarized reflectance from the complex cosine of refraction (Born and Wolf, 1.5.2)."""
    cos_t = np.sqrt(1 - (1 - cos_o**2) / eta**2 + 0j)
    r_s = (cos_o - eta * cos_t) / (cos_o + eta * cos_t)
    r_p = (eta * cos_o - cos_t) / (eta * cos_o + cos_t)
    return np.asarray((abs(r_s) ** 2 + abs(r_p) ** 2) / 2)


@pytest.mark.parametrize("front", [True, False])
@pytest.mark.parametrize("ior", [0.75, 1.0, 1.33, 1.5, 2.4])
def test_laws_of_fresnel_and_snell(device: Device, ior: float, front: bool) -> None:
    """The smallest random number that refracts is F; directions obey sin θo = eta·sin θt and lie in one plane."""
    color, eta = (0.9, 0.5, 1.0), ior if front else 1 / ior
    glass = bsdfs(device, [Dielectric(ior=ior, color=color)])
    cosine = np.linspace(1e-3, 1, 64)
    sine = np.sqrt(1 - cosine**2)
    wo = np.column_stack([0.6 * sine, 0.8 * sine, cosine]).astype(np.float32).astype(np.float64)
    truth = fresnel(wo[:, 2], eta)
    for below in (True, False):
        lobe = truth * (1 - 1e-4) - 1e-6 if below else truth * (1 + 1e-4) + 1e-6
        known = (lobe >= 0) & (lobe < 1)
        numbers = np.column_stack([np.full((64, 2), 0.5), np.clip(lobe, 0, 1 - 2.0**-24)])
        wi, weight, pdf, specular = (a[known] for a in glass.sample(0, wo, numbers, front=front))
        assert specular.all() and np.all(pdf == 1)
        w = wo[known]
        if below:
            assert np.array_equal(wi, w * [-1, -1, 1]) and np.all(weight == 1)
        else:
            assert np.allclose(wi[:, :2], -w[:, :2] / eta, atol=1e-7) and np.all(wi[:, 2] < 0)
            assert np.allclose(np.linalg.norm(wi, axis=1), 1, atol=1e-6)
            assert np.allclose(weight, color)


def test_all_is_reflected_beyond_the_critical_angle(device: Device) -> None:
    """Inside glass of index 1.5, all is reflected for cos θ below √(1 − 1/1.5²)."""
    glass, critical = bsdfs(device, [Dielectric(ior=1.5)]), np.sqrt(1 - 1 / 2.25)
    numbers = np.array([[0.5, 0.5, 1 - 2.0**-24]])
    for cosine, passes in ((critical - 1e-4, False), (critical + 1e-4, True)):
        wi, *_ = glass.sample(0, np.array([np.sqrt(1 - cosine**2), 0, cosine]), numbers, front=False)
        assert (wi[0, 2] < 0) == passes


def test_a_white_furnace_does_not_see_glass(device: Device) -> None:
    """Every path through a clear sphere reaches the sky at a depth below 64 without loss: the image is 1.

    If each surface transmits the share c, F is reflected at once, and what enters leaves again after two surfaces.
    """
    camera = Camera(position=(0.0, 0.0, 5.0), fov_degrees=26)

    def mean(color: float, fov: float) -> Doubles:
        ball = Sphere(material=Dielectric(color=(color,) * 3))
        return film(
            device,
            Scene(
                spheres=[ball],
                camera=replace(camera, fov_degrees=fov),
                environment=SKY,
                render=RenderSettings(size=(32, 32), spp=64, max_depth=64),
            ),
        ).mean

    assert np.allclose(mean(1.0, 26), 1, atol=1e-6)
    noise = np.sqrt(0.25 / 32 / 32 / 64)
    assert mean(0.7, 0.01).mean() == pytest.approx(0.04 + 0.96 * 0.7**2, abs=4 * noise)


def test_lamps_in_glass_are_seen_with_its_radiance(device: Device) -> None:
    """Radiance over eta² is constant along rays: outside, an emitter in glass has (1 − F)/eta² of its radiance."""
    glass = quad([(-9, -9, -1), (9, -9, -1), (9, 9, -1), (-9, 9, -1)], Dielectric(ior=1.5))
    lamp = quad(
        [(-99, -99, -2), (99, -99, -2), (99, 99, -2), (-99, 99, -2)],
        Diffuse(color=(0.0, 0.0, 0.0), emission=(9.0, 9.0, 9.0)),
    )
    camera = Camera(position=(0.0, 0.0, 0.0), look_at=(0.0, 0.0, -1.0), fov_degrees=1)
    picture = film(
        device, Scene(meshes=[glass, lamp], camera=camera, render=RenderSettings(size=(32, 32), spp=256, max_depth=4))
    )
    assert picture.mean.mean() == pytest.approx(9 * 0.96 / 2.25, rel=4 * np.sqrt(0.04 / 0.96 / 32 / 32 / 256))
