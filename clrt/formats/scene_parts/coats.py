"""A coat's share of the light under it, for plastics that `metallic_roughness` stands for."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ...scene.materials.material import ALPHA_MIN
from ...scene.materials.microfacets import albedos
from ...scene.materials.plastic import Distribution, coat_of, fractions


@lru_cache(maxsize=256)
def coat(ior: float, alpha: float, distribution: Distribution, exact: bool = False) -> tuple[float, float]:
    """Return the fraction r of diffuse light that the coat reflects inside, and T²/(ior²·(1 − mean E)) for the mean T
    of what it transmits, where E is the directional albedo of a coat with GGX. r is Mitsuba's unless `exact`."""
    node, weight = np.polynomial.legendre.leggauss(32)
    mu, weight = (node + 1) / 2, weight * (node + 1) / 2
    found = coat_of(ior, alpha**0.5, distribution)
    first, grazing = albedos(mu, max(alpha, ALPHA_MIN), "separable")
    f0 = ((ior - 1) / (ior + 1)) ** 2
    outside = float(weight @ (f0 * (first - grazing) + grazing))
    inside = found.inside
    if exact and alpha > 0:
        inside = float(weight @ fractions(mu, max(alpha, ALPHA_MIN), 1 / ior, distribution)[0])
    return inside, found.mean**2 / (ior**2 * (1 - outside))
