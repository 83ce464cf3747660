"""Warps against their densities, and the sine and cosine they use against float64."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.device.open import Device
from clrt.scene.model import Scene

from ..probe import Probe
from ..stats import chi2_test

Doubles = NDArray[np.float64]
COUNT, SIGNIFICANCE = 1 << 18, 1e-4


@pytest.fixture(scope="module")
def probe(device: Device) -> Probe:
    return Probe(device, Scene())


def warped(probe: Probe, height: float = 0.5, seed: int = 0) -> Doubles:
    """(COUNT, 12): what probe_warps gives for random numbers, in a cone of 1 − cos = `height`."""
    u = np.random.default_rng(seed).integers(1 << 24, size=(COUNT, 2)) / (1 << 24)
    return probe("warps", 12, u, np.full(COUNT, height))


def uniformity(x: Doubles, y: Doubles) -> float:
    """p-value of points being uniform over the unit square."""
    cells = 16 * np.minimum(np.floor(16 * np.clip(x, 0, 1)), 15) + np.minimum(np.floor(16 * np.clip(y, 0, 1)), 15)
    return chi2_test(np.bincount(cells.astype(int), minlength=256), np.full(256, len(x) / 256))


def turn(wi: Doubles) -> Doubles:
    """Azimuth as a fraction of a turn."""
    return np.asarray(np.arctan2(wi[:, 1], wi[:, 0]) / (2 * np.pi) % 1)


def test_cosine_hemisphere(probe: Probe) -> None:
    """pdf cos θ/pi makes sin²θ and the azimuth uniform."""
    out = warped(probe)
    wi, pdf = out[:, :3], out[:, 3]
    assert uniformity(wi[:, 0]**2 + wi[:, 1]**2, turn(wi)) > SIGNIFICANCE
    np.testing.assert_allclose(pdf, np.maximum(wi[:, 2], 0) / np.pi, rtol=2e-7)
    np.testing.assert_allclose(np.linalg.norm(wi, axis=1), 1, atol=3e-7)


@pytest.mark.parametrize("height", [2.0, 1.0, 0.3, 1e-3, 1e-7, 1e-14])
def test_cone(probe: Probe, height: float) -> None:
    """Uniform in 1 − cos θ, which is taken from the sine: cos θ itself is 1 in float32 for the small cones."""
    out = warped(probe, height)
    wi, pdf = out[:, 4:7], out[:, 7]
    one_minus_cos = np.where(wi[:, 2] > 0, (wi[:, 0]**2 + wi[:, 1]**2) / (1 + np.abs(wi[:, 2])), 1 - wi[:, 2])
    assert uniformity(one_minus_cos / height, turn(wi)) > SIGNIFICANCE
    assert one_minus_cos.max() <= height * (1 + 1e-6)
    np.testing.assert_allclose(pdf, 1 / (2 * np.pi * height), rtol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(wi, axis=1), 1, atol=3e-7)


def test_triangle(probe: Probe) -> None:
    """Uniform over b1 + b2 ≤ 1: folded over that edge, half of the points fill the unit square."""
    b1, b2 = warped(probe)[:, 8:10].T
    assert b1.min() >= 0 and b2.min() >= 0 and (b1 + b2).max() <= 1 + 2e-7
    folded = np.arange(COUNT) % 2 == 1
    assert uniformity(np.where(folded, 1 - b1, b1), np.where(folded, 1 - b2, b2)) > SIGNIFICANCE


def test_sine_and_cosine_of_turns(probe: Probe) -> None:
    """Every 16th of the 2^24 arguments that a random number has, and all the small ones."""
    u = np.concatenate([np.arange(0, 1 << 24, 16), np.arange(1, 16), (1 << 24) - np.arange(1, 16)]) / (1 << 24)
    sine, cosine = probe("warps", 12, u, np.zeros((len(u), 2)))[:, 10:].T
    exact = np.sin(2 * np.pi * u), np.cos(2 * np.pi * u)
    assert np.abs(sine - exact[0]).max() < 2.0**-23     # one unit in the last place of 1
    assert np.abs(cosine - exact[1]).max() < 2.0**-23
    small = (u > 0) & (u < 0.125)
    assert np.abs(sine[small] / exact[0][small] - 1).max() < 3e-7
    assert np.abs(sine**2 + cosine**2 - 1).max() < 2.5e-7
