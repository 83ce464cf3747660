"""Coats of plastic, for every index and roughness that a material may have."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from clrt.scene.materials.material import MOST_IOR
from clrt.scene.materials.plastic import Distribution, coat_of, fractions

COSINES = np.linspace(1e-6, 1, 9)


@given(
    ior=st.floats(1, MOST_IOR),
    roughness=st.floats(0, 1),
    distribution=st.sampled_from(get_args(Distribution)),
)
@settings(max_examples=40, deadline=None)
def test_coats_create_no_light(ior: float, roughness: float, distribution: Distribution) -> None:
    """What a coat reflects and transmits is between nothing and all light, without a floating-point error."""
    for eta in (ior, 1 / ior):
        reflected, refracted = fractions(COSINES, max(roughness**2, 1e-4), eta, distribution)
        assert (reflected >= 0).all() and (refracted >= 0).all() and (reflected + refracted <= 1 + 1e-12).all()
    coat = coat_of(ior, roughness, distribution)
    assert 0 <= coat.inside < 1 and 0 < coat.mean <= 1 + 1e-12


@pytest.mark.parametrize("roughness", [0.0, 0.3, 1.0])
def test_a_coat_of_air(roughness: float) -> None:
    """Without refraction nothing is reflected, and values follow from those of an index slightly above."""
    assert coat_of(1.0, 0.0, "ggx").mean == pytest.approx(1)
    none, slight = (coat_of(ior, roughness, "beckmann") for ior in (1.0, 1 + 1e-9))
    assert none.inside == pytest.approx(0, abs=1e-12)
    assert none.transmittance[1:] == pytest.approx(slight.transmittance[1:], abs=1e-4)  # the first is grazing
