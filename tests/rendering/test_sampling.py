"""Warps and light sampling against their densities, and the sine and cosine they use against float64."""

from __future__ import annotations

import numpy as np
import pytest

from clrt.bench.kernel_probe import Probe
from clrt.bench.numerics.light_sampling import lamps, light_tests, picks, skies
from clrt.bench.numerics.samplers import AREA, DENSITY
from clrt.bench.numerics.warps import HEIGHTS, visible_normals, warp_density_errors, warp_p_values, warp_probe
from clrt.bench.significance import rejected
from clrt.device.open import Device

pytestmark = pytest.mark.statistics

SAMPLES = 1 << 16
#: Kernel text and replacements that make it slightly wrong.
WRONG_WARPS = {
    "cone": ("h = u.x * height;", "h = u.x * height * (0.9f + 0.1f * u.x);"),
    "cosine": ("r = radius * sqrt(u.x);", "r = radius * sqrt(u.x * (0.9f + 0.1f * u.x));"),
    "triangle": ("real root = sqrt(u.x);", "real root = sqrt(u.x * (0.9f + 0.1f * u.x));"),
    "turns": ("real x = (u * 4.0f - TO_REAL(q)) * (0.5f * PI);", "real x = (u * 4.0f - TO_REAL(q)) * (0.48f * PI);"),
    "visible normals": ("vector(wo.x * alpha, wo.y * alpha, wo.z)", "vector(wo.x * alpha, wo.y * alpha, 1.1f * wo.z)"),
}
WRONG_LIGHTS = {
    "sphere": ("return outside ? sin2 /", "return outside ? 0.9f * sin2 /"),
    "few": ("below += chances[i];", "below += 1.01f * chances[i];"),
    "many": ("real chances[NODE], chance;", "real chances[NODE], chance; u *= 0.9f;"),
    "sky": ("(TO_REAL(column) + x)", "(TO_REAL(column) + 0.9f * x)"),
}


@pytest.fixture(scope="module")
def probe(device: Device) -> Probe:
    return warp_probe(device)


def test_warps_follow_their_densities(probe: Probe) -> None:
    """Cosine, triangle, cones down to 1e-5 degrees, and visible normals at grazing angles on the smoothest surface."""
    p_values = warp_p_values(probe, SAMPLES, 1)
    assert len(p_values) == 44 and not rejected(p_values)


def test_lights_follow_their_densities(device: Device) -> None:
    """Spheres and triangles of all sizes, environment maps, and light selection. An emitter's density is its closed
    form, an environment map's integrates to 1, and the selection probabilities sum to 1."""
    tests = light_tests(device, SAMPLES, 1)
    assert len(tests) == 21 and not rejected({test.name: test.density for test in tests})
    assert max(test.error for test in tests) < DENSITY


@pytest.mark.parametrize("what", WRONG_WARPS)
def test_a_wrong_warp_is_rejected(device: Device, what: str) -> None:
    """The test of that warp fails; a wrong sine and cosine fails all."""
    wrong = rejected(warp_p_values(warp_probe(device, dict([WRONG_WARPS[what]])), SAMPLES, 1), 1e-9)
    assert wrong and all(what == "turns" or name.startswith(what) for name in wrong)


@pytest.mark.parametrize("what", WRONG_LIGHTS)
def test_a_wrong_light_is_rejected(device: Device, what: str) -> None:
    measure = {"sphere": lamps, "few": picks, "many": picks, "sky": skies}[what]
    tests = measure(device, SAMPLES, 1, dict([WRONG_LIGHTS[what]]))
    assert rejected({test.name: test.density for test in tests}, 1e-9)


def test_densities_are_one_over_the_area_of_the_map(probe: Probe) -> None:
    assert max(warp_density_errors(probe).values()) < AREA


def test_warps_report_their_closed_forms(probe: Probe) -> None:
    """Unit directions with cos θ/pi, or 1/(2·pi·height) inside the cone; triangle points inside the edges."""
    u = np.random.default_rng(0).integers(1 << 24, size=(SAMPLES, 2)) / (1 << 24)
    for height in HEIGHTS:
        out = probe("warps", 12, u, np.full(SAMPLES, height))
        np.testing.assert_allclose(np.linalg.norm(out[:, [0, 1, 2, 4, 5, 6]].reshape(-1, 2, 3), axis=2), 1, atol=3e-7)
        np.testing.assert_allclose(out[:, 3], np.maximum(out[:, 2], 0) / np.pi, rtol=2e-7)
        np.testing.assert_allclose(out[:, 7], 1 / (2 * np.pi * height), rtol=1e-6)
        sin2 = out[:, 4] ** 2 + out[:, 5] ** 2
        assert np.max(np.where(out[:, 6] > 0, sin2 / (1 + np.abs(out[:, 6])), 1 - out[:, 6])) <= height * (1 + 1e-6)
        assert out[:, 8:10].min() >= 0 and out[:, 8:10].sum(axis=1).max() <= 1 + 2e-7


@pytest.mark.parametrize("alpha", [1e-4, 0.3, 1.0])
@pytest.mark.parametrize("cosine", [1.0, 0.3, 1e-4])
def test_normals_are_all_visible(alpha: float, cosine: float) -> None:
    """The cells' probabilities, exact except for one integral, sum to 1."""
    cells = visible_normals(alpha, np.array([np.sqrt(1 - cosine**2), 0.0, cosine]))
    assert cells.sum() == pytest.approx(1, abs=1e-12) and cells.min() >= 0


def test_sine_and_cosine_of_turns(probe: Probe) -> None:
    """Every 16th of the 2^24 arguments that a random number takes, and all the small ones."""
    u = np.concatenate([np.arange(0, 1 << 24, 16), np.arange(1, 16), (1 << 24) - np.arange(1, 16)]) / (1 << 24)
    sine, cosine = probe("warps", 12, u, np.zeros((len(u), 2)))[:, 10:].T
    exact = np.sin(2 * np.pi * u), np.cos(2 * np.pi * u)
    assert np.abs(sine - exact[0]).max() < 2.0**-23  # one unit in the last place of 1
    assert np.abs(cosine - exact[1]).max() < 2.0**-23
    small = (u > 0) & (u < 0.125)
    assert np.abs(sine[small] / exact[0][small] - 1).max() < 3e-7
    assert np.abs(sine**2 + cosine**2 - 1).max() < 2.5e-7
