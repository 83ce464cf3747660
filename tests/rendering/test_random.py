"""Random numbers of the kernels: uniform, and independent across pixels, samples, dimensions and seeds."""

from __future__ import annotations

import numpy as np
import pytest

from clrt.bench.kernel_probe import Probe
from clrt.bench.numerics.random_numbers import Draw, draw_on, independence, repetitions, uniformity
from clrt.bench.significance import rejected
from clrt.device.open import Device
from clrt.scene.model import RenderSettings, Scene

COUNT = 1 << 15
#: Text of core/rng.cl and replacements that weaken it: fewer rounds, exchangeable, truncated or ignored indices.
WEAK = {
    "no second round": ("    x += y * w; y += z * x; z += x * y; w += y * z;\n    return", "    return"),
    "exchangeable": ("hash4(sampler->pixel, sampler->sample,", "hash4(sampler->pixel ^ sampler->sample, (ureal)(0),"),
    "24 bits of the pixel": ("hash4(sampler->pixel,", "hash4(sampler->pixel & 0xffffffu,"),
    "no seed": ("(ureal)(sampler->seed));", "(ureal)(0));"),
}


INDEPENDENT = Scene(render=RenderSettings(sampler="independent"))


@pytest.fixture(scope="module")
def draw(device: Device) -> Draw:
    return draw_on(Probe(device, INDEPENDENT))


@pytest.mark.statistics
def test_numbers_are_uniform(draw: Draw) -> None:
    """Pairs fill the unit square along every index and past 2^31 and 2^32, as do 4-tuples, and every bit is even."""
    p_values = uniformity(draw, COUNT)
    assert len(p_values) > 1000 and not rejected(p_values)


@pytest.mark.statistics
def test_neighbours_are_unrelated(draw: Draw) -> None:
    """Numbers some steps apart in (pixel, sample, dimension, seed) are independent and uncorrelated."""
    p_values = independence(draw, COUNT)
    assert len(p_values) == 800 and not rejected(p_values)


def test_numbers_do_not_repeat(draw: Draw) -> None:
    assert repetitions(draw, 256) == 0


@pytest.mark.statistics
@pytest.mark.parametrize("what", WEAK)
def test_weak_generators_are_rejected(device: Device, what: str) -> None:
    weak = draw_on(Probe(device, INDEPENDENT, changes=dict([WEAK[what]])))
    wrong = rejected(independence(weak, 1 << 13), 1e-9) or rejected(uniformity(weak, 1 << 14), 1e-9)
    assert wrong or repetitions(weak, 64)


def test_numbers_lie_below_one_and_repeat(draw: Draw) -> None:
    """Multiples of 2^-24 in [0, 1), the same for the same indices."""
    u = draw(np.arange(COUNT), 3, 2, 1)
    assert u.min() >= 0 and u.max() < 1
    assert np.all(u * (1 << 24) % 1 == 0)
    assert np.array_equal(u, draw(np.arange(COUNT), 3, 2, 1))


def test_indices_are_taken_modulo_2_to_32(draw: Draw) -> None:
    """All 32 bits of each index count, and no more."""
    last = (1 << 32) - 1
    for index in range(4):
        ends = [[0, 0, 0, 0], [0, 0, 0, 0]]
        ends[0][index], ends[1][index] = last, 1 << 31
        numbers = draw(*np.array([[0, 0, 0, 0], *ends]).T)
        assert len(np.unique(numbers[:, 1])) == 3
