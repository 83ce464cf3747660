"""Tables of the energy that layers take from gloss, against quadratures in other coordinates."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.scene.materials.layer_energy import ENTRY, STEPS, tables
from clrt.scene.materials.microfacets import albedos

from ..rendering import sheen
from ..rendering.layers import Left, taken_from_gloss, under_coat, under_fibres

Doubles = NDArray[np.float64]
PICKED = [12, 24, 48, 72, 96]
COSINES = (np.array(PICKED) / STEPS) ** 2


def entries(base: float, film: float, fibres: float) -> Doubles:
    """Return the entries (STEPS + 4, ENTRY): the means, and those per angle."""
    return np.array(tables((base,), (film,), (fibres,))).reshape(-1, ENTRY)


@pytest.mark.statistics
@pytest.mark.parametrize("base", [0.1, 0.3, 0.7, 1.0])
@pytest.mark.parametrize("film, fibres", [(0.0, 0.15), (0.3, 0.3), (0.8, 1.0)])
def test_what_layers_take_from_gloss(base: float, film: float, fibres: float) -> None:
    """∫ gloss·(T(wo) − min(T(wo), T(wi))) dwi of coat, sheen, and both, for f0 and f90."""
    coat, threads = under_coat(1, film), under_fibres(1, fibres)
    layers: list[Left] = [coat, threads, lambda c: coat(c) + threads(c) - coat(c) * threads(c)]  # 1 − E·E of both
    found = entries(base, film, fibres)[3:][PICKED]
    for layer, left in enumerate(layers):
        whole, by_f90 = (np.array([taken_from_gloss(left, c, base**2, f0) for c in COSINES]) for f0 in (1.0, 0.0))
        np.testing.assert_allclose(found[:, 2 * layer], whole - by_f90, atol=6e-4)
        np.testing.assert_allclose(found[:, 2 * layer + 1], by_f90, atol=6e-4)


@pytest.mark.parametrize("fibres", [0.1, 0.3, 1.0])
def test_what_a_film_takes_from_fibres(fibres: float) -> None:
    found, n = entries(0.5, 0.2, fibres)[3:][PICKED], fibres**-2
    values = sheen.across(COSINES, n) * sheen.WEIGHT
    values /= np.maximum(np.maximum(values.sum(axis=1)[:, None], sheen.albedo(sheen.COS_I, n)), 1)
    left = under_coat(1, 0.2)
    taken = np.maximum(left(COSINES)[:, None] - left(sheen.COS_I), 0)
    np.testing.assert_allclose(found[:, 6], np.sum(values * taken, axis=1), atol=6e-4)
    part = sheen.bounded_albedo(COSINES, n) / np.minimum(sheen.albedo(COSINES, n), 1)
    np.testing.assert_allclose(found[:, 7], part, atol=2e-3)


def test_means_are_those_of_the_hemisphere() -> None:
    """Means of the entries, and of the albedos of coat, sheen, and both, times 1 and times the base's reflection."""
    table, base = entries(0.4, 0.1, 0.5), 0.4
    roots = np.linspace(1e-3, 1, 2001)

    def mean(values: Doubles) -> Doubles:
        return np.asarray(np.trapezoid(4 * roots**3 * values, roots))

    angles = [np.interp(roots, np.linspace(0, 1, STEPS + 1), each) for each in table[3:].T]
    np.testing.assert_allclose(table[0], [mean(each) for each in angles], rtol=1e-4)
    film, fibres = 1 - under_coat(1, 0.1)(roots**2), 1 - under_fibres(1, 0.5)(roots**2)
    whole, grazing = albedos(roots**2, base**2, "height_correlated")
    below = [np.ones_like(whole), whole - grazing, grazing, 1 - whole]
    expected = [mean(each * part) for each in (film, fibres, film * fibres) for part in below]
    np.testing.assert_allclose(table[1:3].ravel()[:12], expected, rtol=2e-3, atol=2e-5)
