"""Integrals behind the plugins for Mitsuba; Mitsuba itself is not needed."""

from __future__ import annotations

import numpy as np
import pytest

from clrt.bench.renderers.mitsuba_plugins.glass_losses import losses
from clrt.bench.renderers.mitsuba_plugins.layer_tables import ROOTS
from clrt.scene.materials.dielectric_energy import at_cosines, grazing, sides


@pytest.mark.parametrize(("ior", "roughness"), [(1.5, 0.3), (1.5, 0.7), (2.4, 1.0)])
def test_losses_of_glass_are_those_of_another_integral(ior: float, roughness: float) -> None:
    """The sums over a lattice that the kernels' tables are made of."""
    table, _ = losses(ior, roughness**2)
    for side, (loss, rest) in enumerate(zip(table.T[::2], table.T[1::2])):
        expected = sides(ior, roughness**2)[side]
        near = grazing(ior, roughness**2)
        np.testing.assert_allclose(loss, at_cosines(expected.loss, ROOTS**2, near), atol=2e-3)
        np.testing.assert_allclose(rest, at_cosines(expected.rest, ROOTS**2, near), atol=2e-3)
