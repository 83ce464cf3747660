"""Absorbing glass of Mitsuba's and pbrt's scenes, for every rate that a file may have."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from clrt.errors import SceneError
from clrt.formats.scene_parts.absorbing_glass import absorbing_glass
from clrt.scene.materials.material_types import Dielectric


@given(st.tuples(st.floats(0, 1e6), st.floats(0, 1e6), st.floats(0, 1e6)), st.floats(1e-3, 10))
def test_light_falls_by_beer_and_lamberts_law(rates: tuple[float, float, float], length: float) -> None:
    glass = absorbing_glass(Dielectric(), rates, "a medium")
    distance = glass.attenuation_distance or np.inf
    left = np.array(glass.attenuation_color) ** (length / distance)
    np.testing.assert_allclose(left, np.exp(-np.multiply(rates, length)), rtol=1e-6, atol=1e-9)


@given(st.tuples(st.floats(), st.floats(), st.floats()))
def test_any_rate_is_used_or_named(rates: tuple[float, float, float]) -> None:
    if all(0 <= rate < np.inf for rate in rates):
        assert all(0 <= part <= 1 for part in absorbing_glass(Dielectric(), rates, "a medium").attenuation_color)
    else:
        with pytest.raises(SceneError, match=r"a medium: absorbs .* per length; write at least 0"):
            absorbing_glass(Dielectric(), rates, "a medium")
