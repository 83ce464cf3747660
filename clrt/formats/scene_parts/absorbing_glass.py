"""Glass with a medium inside that absorbs and does not scatter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import exp, isfinite

from ...errors import SceneError
from ...scene.fields.field_types import FLOAT32_MAX
from ...scene.materials.material_types import Dielectric


def absorbing_glass(glass: Dielectric, rates: Sequence[float], at: str) -> Dielectric:
    """Return glass that absorbs these rates of red, green and blue per length. at: the medium in messages.

    Raises SceneError for rates that are negative or not finite.
    """
    for rate in rates:
        if not isfinite(rate) or rate < 0:
            raise SceneError(f"{at}: absorbs {rate:g} per length; write at least 0")
    most = max(rates)
    if most * FLOAT32_MAX <= 1:  # over any distance
        return glass
    red, green, blue = (exp(-rate / most) for rate in rates)
    return replace(glass, attenuation_color=(red, green, blue), attenuation_distance=1 / most)
