"""Alias tables hold the probabilities they were built for, and the kernels pick by them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from clrt.device.open import Device
from clrt.rendering.alias import alias_table
from clrt.scene.materials import Diffuse
from clrt.scene.model import Mesh, Scene
from clrt.study.significance import chi2_test
from clrt.study.probe import Probe


Doubles = NDArray[np.float64]
RNG = np.random.default_rng(7)
WEIGHTS = {
    "one": np.array([3.0]),
    "two": np.array([1.0, 3.0]),
    "pairs": np.array([1.0, 1.0, 3.0, 3.0]),     # what the light entries lack and the heavy ones exceed is equal
    "equal": np.full(1000, 0.1),
    "random": RNG.random(10_000),
    "sun": np.where(np.arange(20_000) == 777, 1e5, 1.0),
    "one_of_many": np.eye(1, 500, 123).ravel(),
    "half_zero": np.where(RNG.random(3000) < 0.5, 0.0, RNG.random(3000)),
    "many_magnitudes": 10.0 ** RNG.uniform(-30, 30, 2000),
    "descending": 1.0 / np.arange(1, 5000),
}


def check(weights: Doubles) -> None:
    """What slots and aliases give each entry, summed in float64, is its share of the weights.

    A threshold is off by a rounding of float32, 2^-25, for the entry and for each slot that names it as its alias, and
    by the prefix sums' roundings of float64, which grow to n.
    """
    n, share = len(weights), weights / weights.sum()
    threshold, alias, probability = alias_table(weights)
    assert threshold.dtype == np.float32 and alias.dtype == np.int32
    assert np.all((threshold >= 0) & (threshold <= 1)) and np.all((alias >= 0) & (alias < n))
    given_away = 1 - threshold.astype(np.float64)
    names = np.bincount(alias, weights=given_away > 0, minlength=n)
    slots = threshold + np.bincount(alias, weights=given_away, minlength=n)
    np.testing.assert_allclose(probability, share, rtol=1e-14)
    assert np.all(np.abs(slots - n * share) <= (1 + names) * 2.0**-25 + 4 * n * n * 2.0**-53)
    assert not np.any(slots[weights == 0])


@pytest.mark.parametrize("name", WEIGHTS)
def test_probabilities_are_the_weights(name: str) -> None:
    check(WEIGHTS[name])


@given(st.lists(st.floats(0, 1e6), min_size=1, max_size=40).filter(any))
def test_probabilities_of_any_weights(weights: list[float]) -> None:
    check(np.array(weights))


@pytest.mark.parametrize("name", ["two", "pairs", "equal", "sun", "random", "half_zero"])
def test_picks_follow_the_probabilities(device: Device, name: str) -> None:
    """Triangles of one lamp are chosen by their areas."""
    weights = WEIGHTS[name]
    vertices = np.zeros((3 * len(weights), 3), np.float32)
    vertices[1::3, 0], vertices[2::3, 1] = weights, 1
    lamp = Mesh(vertices, np.arange(len(vertices), dtype=np.int32).reshape(-1, 3), Diffuse(emission=(1.0, 1.0, 1.0)))
    probe = Probe(device, Scene(meshes=[lamp]))
    picked = probe("alias", 1, np.zeros(1 << 20), seed=4)[:, 0].astype(int)
    expected = weights / weights.sum() * len(picked)
    np.testing.assert_allclose(probe.compiled.buffers["lights"][1]["probability"], weights / weights.sum(), rtol=1e-6)
    assert chi2_test(np.bincount(picked, minlength=len(weights)), expected) > 1e-4
