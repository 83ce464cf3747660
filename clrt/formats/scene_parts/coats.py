"""How much light a dielectric coat lets through, and reflects from inside: what Mitsuba derives its plastics from."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ...scene.materials.material import ALPHA_MIN
from ...scene.materials.microfacets import albedos

Doubles = NDArray[np.float64]
#: Facets per side of a grid over their visible normals.
GRID = 64
#: Number of cosines of Mitsuba's sum for r.
SUM = 64


@lru_cache(maxsize=256)
def coat(ior: float, alpha: float, distribution: str) -> tuple[float, float]:
    """Return Mitsuba's r, and T²/(ior²·(1 − mean E)) for the mean T, where E is that of a coat with GGX."""
    node, weight = np.polynomial.legendre.leggauss(32)
    mu, weight = (node + 1) / 2, weight * (node + 1) / 2
    through = float(weight @ _fractions(mu, max(alpha, ALPHA_MIN), ior, distribution)[1])
    first, grazing = albedos(mu, max(alpha, ALPHA_MIN), "separable")
    f0 = ((ior - 1) / (ior + 1)) ** 2
    outside = float(weight @ (f0 * (first - grazing) + grazing))
    if alpha == 0:
        inside = 1 - through / ior**2
    else:  # the sum by which Mitsuba computes it, 0.98 of the integral
        grid = np.linspace(1e-6, 1, SUM)
        inside = float(2 * np.mean(_fractions(grid, alpha, 1 / ior, distribution)[0] * grid))
    return inside, through**2 / (ior**2 * (1 - outside))


def _fractions(mu: Doubles, alpha: float, ior: float, distribution: str) -> tuple[Doubles, Doubles]:
    """Return the fractions (n,) of light at cosines (n,) that visible facets reflect and refract, each times G1 of the
    direction that it leaves in (Walter et al. 2007)."""
    steps = np.arange(GRID) / GRID
    rest, phi = (grid.ravel() for grid in np.meshgrid(steps + 0.5 / GRID, 2 * np.pi * steps))
    above = rest**3  # the fraction of steeper facets; the steepest are what grazing light meets
    tangent2 = alpha**2 * (1 / above - 1 if distribution == "ggx" else -np.log(above))
    z = 1 / np.sqrt(1 + tangent2)
    cosine = mu[:, None] * z + np.sqrt(1 - mu**2)[:, None] * np.sqrt(1 - z**2) * np.cos(phi)
    seen = np.maximum(cosine, 0) / z * rest**2
    seen /= seen.sum(axis=1, keepdims=True)
    cos2 = 1 - (1 - cosine**2) / ior**2
    cos_t = np.sqrt(np.maximum(cos2, 0))
    across = (cosine - ior * cos_t) / (cosine + ior * cos_t)
    along = (ior * cosine - cos_t) / (ior * cosine + cos_t)
    fresnel = np.where(cos2 > 0, (across**2 + along**2) / 2, 1)
    reflected = _visible(2 * cosine * z - mu[:, None], alpha, distribution)
    refracted = _visible(mu[:, None] / ior - (cosine / ior - cos_t) * z, alpha, distribution)
    return np.sum(seen * fresnel * reflected, axis=1), np.sum(seen * (1 - fresnel) * refracted, axis=1)


def _visible(z: Doubles, alpha: float, distribution: str) -> Doubles:
    """Return Smith's G1 of directions with these cosines, for Beckmann in Walter's rational form; 0 at and below the
    horizon."""
    up = np.clip(z, 1e-9, 1)
    tangent = np.sqrt(np.maximum(1 / up**2 - 1, 1e-18))
    if distribution == "ggx":
        g1 = 2 / (1 + np.sqrt(1 + (alpha * tangent) ** 2))
    else:
        a = np.minimum(1 / (alpha * tangent), 1.6)
        g1 = np.minimum((3.535 * a + 2.181 * a**2) / (1 + 2.276 * a + 2.577 * a**2), 1)
    return np.where(z > 0, g1, 0)
