"""The kernels' tables of directional albedos of GGX, against integrals in float64."""

from __future__ import annotations

import re

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.bench.numerics.albedo_tables import Table, evaluate, mean_scale
from clrt.bench.numerics.furnace import SMITHS
from clrt.device.programs.kernel_files import kernel_folder
from clrt.scene.materials import microfacets
from clrt.scene.materials.metallic_roughness import Smith

from . import ggx

pytestmark = pytest.mark.statistics

Doubles = NDArray[np.float64]
ROUGHNESSES = np.append(np.linspace(0.02, 1, 30), 0.01)
COSINES = np.geomspace(1e-5, 1, 300)


def read_table(smith: Smith) -> Table:
    """Parse the numbers of a kernel file."""
    text = (kernel_folder() / f"bsdf/albedo_{smith}.cl").read_text()
    blocks = re.findall(r"constant float \w+\[.*?\};", text, re.DOTALL)
    arrays = [np.array(re.findall(r"-?\d+\.\d*(?:e[+-]?\d+)?(?=f)", block), float) for block in blocks]
    return Table(arrays[0].reshape(8, 8), arrays[1].reshape(8, 6), arrays[2], arrays[3])


@pytest.mark.parametrize("smith", SMITHS)
@pytest.mark.parametrize("roughness", [0.05, 0.3, 1.0])
def test_albedo(roughness: float, smith: Smith) -> None:
    """The quadrature against a brute-force one in other coordinates: with F = 1, and with Schlick's 5th power."""
    alpha, cosines = roughness**2, np.array([1.0, 0.6, 0.2, 0.05])
    expected = np.transpose([ggx.albedos(alpha, cosine, smith, steps=1500) for cosine in cosines])
    np.testing.assert_allclose(microfacets.albedos(cosines, alpha, smith), expected, atol=2e-4)


@pytest.mark.parametrize("smith, most", list(zip(SMITHS, (6e-4, 8e-4, 1e-3, 1.2e-3), strict=True)))
def test_albedos_are_fitted(smith: Smith, most: float) -> None:
    """The loss of one bounce with F = 1, and the albedo with F = (1 − wo·h)^5, at every angle and roughness."""
    table = read_table(smith)
    for roughness in ROUGHNESSES:
        whole, grazing = microfacets.albedos(COSINES, roughness**2, smith)
        loss, fresnel = evaluate(table, COSINES, roughness**2, smith)
        assert np.abs(loss - np.maximum(1 - whole, 0)).max() < most, roughness
        assert np.abs(fresnel - grazing).max() < most, roughness


@pytest.mark.parametrize("smith, most", list(zip(SMITHS, (2e-4, 2e-4, 2e-4, 1.3e-3), strict=True)))
def test_means_are_those_of_the_fits(smith: Smith, most: float) -> None:
    """Hemispherical means weighted by 2·cos: energy is conserved if they match the fits, whatever the fits' error."""
    table = read_table(smith)
    t, weight = np.polynomial.legendre.leggauss(400)
    log_cosines = 8 * (t - 1)
    cosines = np.exp(log_cosines)
    for roughness in ROUGHNESSES:
        alpha, y = roughness**2, 2 * np.sqrt(roughness) - 1
        loss, fresnel = evaluate(table, cosines, alpha, smith)
        exact = 8 * np.array([loss, fresnel]) @ (weight * 2 * cosines**2)
        lost = mean_scale(np.array(alpha), smith) * np.polynomial.polynomial.polyval(y, table.mean_loss)
        # Of the energy lost at an angle, lost/exact is restored.
        assert abs(lost / exact[0] - 1) * loss.max() < most, roughness
        assert np.polynomial.polynomial.polyval(y, table.mean_fresnel) == pytest.approx(exact[1], abs=4e-4), roughness
