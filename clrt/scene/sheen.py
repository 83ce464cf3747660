"""What a sheen of fibres reflects of light from each angle, as a polynomial that a kernel can evaluate.

D(h) = (2 + n)/(2·pi)·sin^n θh with n = 1/roughness² (Estevez and Kulla 2017, "Production Friendly Microfacet Sheen
BRDF"), as glTF's KHR_materials_sheen has it, and V = 1/(4·(cos wo + cos wi − cos wo·cos wi)) (Neubelt and Pettineo
2013).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]

#: Coefficients of the polynomial in √cos; it is then off by less than 2.5e-3, which it is at the horizon.
COEFFICIENTS = 12
#: Smoother fibres than this would shine at the horizon alone.
SMOOTHEST = 0.1


def power(roughness: float) -> float:
    """n of D(h)."""
    return float(1 / max(roughness, SMOOTHEST)**2)


@lru_cache
def fitted_albedo(roughness: float) -> tuple[float, ...]:
    """Coefficients, lowest first, of `albedo` in x = 2·√cos − 1, interpolated at Chebyshev points."""
    x = np.polynomial.chebyshev.chebpts1(COEFFICIENTS)
    values = albedo(((x + 1) / 2)**2, power(roughness))
    found = np.linalg.solve(np.polynomial.polynomial.polyvander(x, COEFFICIENTS - 1), values)
    return tuple(found.astype(np.float32).tolist())


def albedo(cosines: Doubles, n: float) -> Doubles:
    """(m,) of cosines (m,) in (0, 1]: ∫ D·V·cos wi dωi, by Gauss and Legendre's rule, denser at the horizon."""
    nodes, weights = np.polynomial.legendre.leggauss(96)
    u = (nodes + 1) / 2
    cos_i, weight = u**2, weights * u    # dcos = 2u du
    phi = np.pi * (np.arange(96) + 0.5) / 96
    co, ci = np.asarray(cosines)[:, None, None], cos_i[:, None]
    along = np.sqrt((1 - co**2) * (1 - ci**2)) * np.cos(phi)
    cos_h = (co + ci) / np.sqrt(np.maximum(2 * (1 + co * ci + along), 1e-300))
    d = (2 + n) / (2 * np.pi) * np.maximum(1 - cos_h**2, 0)**(n / 2)
    values = d * ci / (4 * (co + ci - co * ci))
    return np.asarray(2 * np.pi * values.mean(axis=2) @ weight)
