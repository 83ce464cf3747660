"""Padding against scipy's distance transform."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from clrt.baking.padding import padded

from ..oracle.scenes import todays_seed


@pytest.mark.parametrize("texels", [0, 1, 4, 100])
@pytest.mark.parametrize("share", [0, 0.005, 0.1, 0.9, 1])
def test_texels_around_charts_repeat_the_nearest(texels: int, share: float) -> None:
    random = np.random.default_rng(todays_seed())
    covered = random.random((31, 40)) < share
    values = np.where(covered[..., None], random.random((31, 40, 2)), 0).astype(np.float32)
    filled = padded(values, covered, texels)
    assert np.array_equal(filled[covered], values[covered])
    if not covered.any():
        assert not filled.any()
        return
    away = distance_transform_edt(~covered)
    reached = away <= texels
    assert not filled[~reached].any()
    places = np.argwhere(covered)
    for y, x in np.argwhere(reached & ~covered):
        distance = np.hypot(*(places - (y, x)).T)
        nearest = places[np.isclose(distance, away[y, x])]
        assert any(np.array_equal(filled[y, x], values[i, j]) for i, j in nearest)
