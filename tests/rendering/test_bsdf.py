"""Every material of the registry: its samples follow its density, it is reciprocal, and it makes no light."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.device.open import Device
from clrt.scene.materials import Diffuse, MetallicRoughness, Mirror

from ..stats import chi2_test, mean_test, sidak
from . import directions
from .bsdfs import COSINES, Bsdfs, bsdfs, uniform, view
from .ggx import albedo, cook_torrance

Doubles = NDArray[np.float64]
FAMILY, SAMPLES = 1e-3, 100_000

#: Two computations of one float32 formula whose products a compiler may fuse or not: some dozen roundings apart.
ROUNDING = 2e-6


@dataclass
class Drawn:
    """Samples of one material, seen from wo; `weight` is 0 where the sample failed (pdf 0)."""

    bsdfs: Bsdfs
    material: int
    wo: Doubles
    wi: Doubles
    weight: Doubles
    pdf: Doubles
    specular: bool

    def __str__(self) -> str:
        return f"cos {self.wo[2]:.3g}: {self.bsdfs.materials[self.material]}"


@pytest.fixture(scope="module")
def every(device: Device) -> Bsdfs:
    return bsdfs(device)


@pytest.fixture(scope="module")
def drawn(every: Bsdfs) -> list[Drawn]:
    """Every material from every angle."""
    cases = []
    for i in range(len(every.materials)):
        for k, cosine in enumerate(COSINES):
            wi, weight, pdf, specular = every.sample(i, view(cosine), uniform(SAMPLES, len(COSINES) * i + k))
            assert specular.min() == specular.max()
            cases.append(Drawn(every, i, view(cosine), wi, weight, pdf, bool(specular[0])))
    return cases


def test_samples_follow_the_density(drawn: list[Drawn]) -> None:
    """Chi-square over cells of the hemisphere, and one for the failed samples: what the pdf's integral leaves out."""
    lobes = [case for case in drawn if not case.specular]
    p_values, integrals = [], []
    for case in lobes:
        kept = case.pdf > 0
        observed = directions.count(case.wo, case.wi[kept])
        expected = directions.integrate(lambda w: case.bsdfs.value(case.material, case.wo, w)[1], case.wo)
        integrals.append(expected.sum())
        rest = max(1 - expected.sum(), 0.0)
        p_values.append(chi2_test([*observed, SAMPLES - kept.sum()], SAMPLES * np.array([*expected, rest]) + 1e-9))
    wrong = [f"p = {p:.2g}, {case}" for p, case in zip(p_values, lobes) if p < sidak(FAMILY, len(lobes))]
    assert not wrong, "\n".join(wrong)
    assert max(integrals) < 1 + 2e-4  # the quadrature's error, seen at densities that are 1 by construction


def test_failed_samples_are_below_the_horizon(drawn: list[Drawn]) -> None:
    for case in drawn:
        failed = case.pdf == 0
        assert np.all(case.wi[failed, 2] <= 0), case
        assert np.all(case.weight[failed] == 0), case
        assert np.all(case.wi[~failed, 2] >= 0), case


def test_directions_are_unit_vectors(drawn: list[Drawn]) -> None:
    for case in drawn:
        np.testing.assert_allclose(np.linalg.norm(case.wi, axis=1), 1, atol=1e-6, err_msg=str(case))


def test_weight_is_value_over_density(drawn: list[Drawn]) -> None:
    for case in drawn:
        if not case.specular:
            kept = (case.pdf > 0) & (case.wi[:, 2] > 0)
            value, pdf = case.bsdfs.value(case.material, case.wo, case.wi[kept])
            np.testing.assert_allclose(case.pdf[kept], pdf, rtol=ROUNDING, err_msg=str(case))
            np.testing.assert_allclose(case.weight[kept], value / pdf[:, None], rtol=ROUNDING, err_msg=str(case))


def test_specular_is_a_single_direction(drawn: list[Drawn]) -> None:
    """Neither eval nor pdf knows it, and the numbers do not move it."""
    specular = [case for case in drawn if case.specular]
    assert {type(case.bsdfs.materials[case.material]) for case in specular} == {Mirror}
    for case in specular:
        assert np.all(case.wi == case.wi[0])
        value, pdf = case.bsdfs.value(case.material, case.wo, case.wi)
        assert not value.any() and not pdf.any()


def test_reciprocity(every: Bsdfs) -> None:
    """f(wo, wi) = f(wi, wo); eval gives f·cos wi."""
    wo, wi = (directions_above(20_000, seed) for seed in (1, 2))
    for i, material in enumerate(every.materials):
        there, back = every.value(i, wo, wi)[0] / wi[:, 2:], every.value(i, wi, wo)[0] / wo[:, 2:]
        # wi·h and wo·h, equal in truth, differ by their roundings, which the fifth power of F takes five times.
        np.testing.assert_allclose(there, back, rtol=5 * ROUNDING, atol=1e-6, err_msg=str(material))


def test_below_the_horizon_nothing_is_reflected(every: Bsdfs) -> None:
    wo, wi = directions_above(1000, 3), directions_above(1000, 4) * [1, 1, -1]
    for i, material in enumerate(every.materials):
        for a, b in ((wo, wi), (wi, wo)):
            assert not every.value(i, a, b)[0].any(), material
        assert not every.value(i, wo, wi)[1].any(), material


def test_cook_torrance(every: Bsdfs) -> None:
    """eval against the formula of the theses, in float64, in all its forms."""
    wo, wi = (directions_above(20_000, seed) for seed in (5, 6))
    for i, material in enumerate(every.materials):
        if isinstance(material, MetallicRoughness) and material.roughness > 0.05:
            expected = cook_torrance(material, wo, wi) * wi[:, 2:]
            # A half vector of float32 turns D by some roundings over alpha²; 1 − F is off by two roundings of 1.
            np.testing.assert_allclose(every.value(i, wo, wi)[0], expected, rtol=3e-6 / material.roughness**2,
                                       atol=2 * 2**-24 / np.pi, err_msg=str(material))


def test_no_light_is_made(drawn: list[Drawn]) -> None:
    """In a white furnace nothing is brighter than 1: one-sided test of the mean weight."""
    p_values = []
    for case in drawn:
        mean, variance = case.weight.mean(axis=0), case.weight.var(axis=0)
        p = mean_test(mean, np.maximum(variance, 1e-12), SAMPLES, 1.0)
        p_values.append(np.where(mean > 1 + 1e-6, p / 2, 1).min())
    wrong = [f"p = {p:.2g}, mean {case.weight.mean(axis=0)}, {case}" for p, case in zip(p_values, drawn)
             if p < sidak(FAMILY, 3 * len(drawn))]
    assert not wrong, "\n".join(wrong)


def test_white_furnace(device: Device) -> None:
    """Diffuse and mirror reflect their color exactly; GGX of F = 1 its single-scatter albedo."""
    color, white = (0.8, 0.5, 0.2), (1.0, 1.0, 1.0)
    metals = [MetallicRoughness(color=white, metallic=1.0, roughness=roughness, smith=smith)
              for roughness in (0.3, 0.6, 1.0) for smith in ("height_correlated", "separable")]
    furnace = bsdfs(device, [Diffuse(color=color), Mirror(color=color), *metals])
    tests = []
    for cosine in (1.0, 0.6, 0.2, 0.05):
        for exact in (0, 1):
            _, weight, _, _ = furnace.sample(exact, view(cosine), uniform(1000, exact))
            assert np.all(weight == np.array(color, np.float32))
        for i, metal in enumerate(metals, start=2):
            _, weight, _, _ = furnace.sample(i, view(cosine), uniform(400_000, i))
            expected = albedo(metal.roughness**2, cosine, metal.smith)
            tests.append(mean_test(weight[:, 0].mean(), weight[:, 0].var(), len(weight), expected))
    assert min(tests) > sidak(FAMILY, len(tests))


def directions_above(count: int, seed: int) -> Doubles:
    """(count, 3) unit vectors all over the upper hemisphere, as float32 holds them."""
    w = np.random.default_rng(seed).normal(size=(count, 3))
    w[:, 2] = np.maximum(np.abs(w[:, 2]), 1e-3)
    unit: Doubles = (w / np.linalg.norm(w, axis=1, keepdims=True)).astype(np.float32).astype(np.float64)
    return unit
