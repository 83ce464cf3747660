"""Energy loss of a single bounce at rough glass against another quadrature, and compensation against a random walk."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.scene.materials import dielectric_energy as energy
from clrt.scene.materials.material import ALPHA_MIN
from clrt.scene.materials.material_types import Dielectric
from clrt.scene.materials.microfacets import albedo

from ..covering import others
from .microsurface import reflected_part

Doubles = NDArray[np.float64]


def single_bounce(alpha: float, eta: float, cosine: float, steps: int = 1500) -> float:
    """Return the albedo of Walter's formula (2007, eq. 20 and 21), reflected and transmitted, integrated over normals
    by slope: the midpoint rule in the azimuth and in x, tan² θ = alpha²·(1 − r)/r with r = (1 − x)³."""
    x, phi = (np.arange(steps) + 0.5)[:, None] / steps, np.pi * (np.arange(steps) + 0.5) / steps
    rest = (1 - x) ** 3
    tangent = alpha * np.sqrt((1 - rest) / rest)
    up = 1 / np.sqrt(1 + tangent**2)
    cos_o = np.maximum(cosine * up + np.sqrt(1 - cosine**2) * tangent * up * np.cos(phi), 1e-12)
    weight = 3 * (1 - x) ** 2 * cos_o / (cosine * up)  # D·(wo·h)/cos wo dωh
    cos2_t = 1 - (1 - np.minimum(cos_o, 1) ** 2) / eta**2
    cos_t = np.sqrt(np.maximum(cos2_t, 0))
    parallel = (eta * cos_o - cos_t) / (eta * cos_o + cos_t)
    perpendicular = (cos_o - eta * cos_t) / (cos_o + eta * cos_t)
    fresnel = np.where(cos2_t > 0, (parallel**2 + perpendicular**2) / 2, 1)

    def seen(cos_i: Doubles) -> Doubles:
        root_o, root_i = (np.sqrt(1 + alpha**2 * (1 / c**2 - 1)) for c in (cosine, np.maximum(cos_i, 1e-9)))
        return np.where(cos_i > 0, 2 / (root_o + root_i), 0)

    back, on = 2 * cos_o * up - cosine, cosine / eta - (cos_o / eta - cos_t) * up
    return float(np.sum(weight * (fresnel * seen(back) + (1 - fresnel) * seen(on))) / steps**2)


@pytest.mark.parametrize(("ior", "roughness"), [(1.5, 0.6), *others((2.4, 0.3), (1.5, 1.0), (1.02, 0.8), (0.5, 0.5))])
def test_losses_of_a_single_bounce(ior: float, roughness: float) -> None:
    alpha = roughness**2
    cosines = energy.angles(energy.grazing(ior, alpha))
    for side, eta in zip(energy.sides(ior, alpha), (ior, 1 / ior)):
        for step in (20, 55, 96):
            expected = 1 - single_bounce(alpha, eta, float(cosines[step]))
            assert side.loss[step] == pytest.approx(expected, abs=1e-3), (eta, cosines[step])


def test_a_thin_sheet_loses_what_a_mirror_does() -> None:
    for alpha in (0.01, 0.3, 1.0):
        cosines = energy.angles(energy.grazing(1.5, alpha, thin=True))
        side, same = energy.sides(1.5, alpha, thin=True)
        assert side is same
        np.testing.assert_allclose(1 - side.loss, albedo(cosines, alpha, "height_correlated"), atol=4e-4)


def test_nothing_is_lost_where_it_is_smooth() -> None:
    """Losses occur only at grazing angles of about alpha."""
    for side in energy.sides(1.5, ALPHA_MIN):
        assert side.mean < 1e-6 and side.loss[energy.angles(ALPHA_MIN) > 0.1].max() < 1e-3


def test_the_rest_balances() -> None:
    """Equal energy passes either way, in radiance over n²: the shares are those of n²·∫ rest·2c dc."""
    for ior in (0.4, 1.1, 1.5, 2.5):
        near = energy.grazing(ior, 0.49)
        row = np.array(energy.tables(ior, 0.7, False)).reshape(2, energy.STEPS + 2, 2)
        (m, part), (m_inside, part_inside) = row[:, -1]
        assert part + part_inside == pytest.approx(1)
        assert m_inside * ior**2 == pytest.approx(m, rel=1e-5)
        squares, rest = energy.angles(near) ** 2, row[:, :-1, 1]
        integrals = np.sum((rest[:, 1:] + rest[:, :-1]) / 2 * np.diff(squares), axis=1) * [1, ior**2]
        mean = m * near**2 * np.log1p(near**-2)
        assert [part * mean, part_inside * mean] == pytest.approx(list(integrals), rel=0.01, abs=1e-6)


def test_rows_are_the_tables_of_their_roughness() -> None:
    shape = -1, 2, energy.STEPS + 2, 2
    rows = np.reshape(energy.tables(1.5, None, False), shape)
    for row in (0, 7, 24):
        one = np.reshape(energy.tables(1.5, (row / (energy.ROWS - 1)) ** 2, False), shape)
        np.testing.assert_allclose(rows[row, :, :-1], one[0, :, :-1], atol=2e-3)


@pytest.mark.parametrize(
    ("ior", "roughness", "most"),
    [(1.5, 0.6, 0.03), (2.4, 0.6, 0.03), (1.5, 0.3, 0.02), (2.4, 1.0, 0.06), (1.5, 1.0, 0.18)],
)
def test_sides_share_light_as_in_a_random_walk(ior: float, roughness: float, most: float) -> None:
    """The reflected share of all light agrees, from angles on both sides."""
    rng, alpha = np.random.default_rng(1), roughness**2
    near, (outside, inside) = energy.grazing(ior, alpha), energy.sides(ior, alpha)
    parts = np.array([outside.mean, inside.mean * ior**2])
    for side, eta, part in zip((outside, inside), (ior, 1 / ior), parts / parts.sum()):
        for cosine in (1.0, 0.6, 0.3):
            at = np.array([cosine])
            bounce = energy.bounce(energy.microfacets(at, alpha), alpha, eta)
            loss, rest = (energy.at_cosines(values, at, near)[0] for values in (side.loss, side.rest))
            there = energy.at_cosines(side.loss, bounce.back, near)
            found = float((bounce.reflected / (1 - np.minimum(loss, there))).sum() + rest * part)
            assert found == pytest.approx(reflected_part(alpha, eta, cosine, 20_000, rng), abs=most), (eta, cosine)


def test_only_rough_glass_has_a_table() -> None:
    single = Dielectric(roughness=0.5, multiple_scattering=False)
    for plain in (Dielectric(), Dielectric(roughness=0.5, ior=1.0), single):
        assert "energy" not in plain.parameters() and "DIELECTRIC_ENERGY" not in plain.features()
    assert "DIELECTRIC_ENERGY" in Dielectric(roughness=0.5).features()
