"""What white fibres reflect of light from each angle, in float64, and a polynomial for it (kernels/bsdf/sheen.cl)."""

from __future__ import annotations

import numpy as np
from numpy.polynomial import chebyshev, polynomial
from numpy.typing import NDArray

Doubles = NDArray[np.float64]


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


def interpolated(across: int, along: int) -> Doubles:
    """(across, along) coefficients of powers of x = 2·√cos − 1 and of y = 1 + 2·log10(roughness), at Chebyshev points.
    """
    x, y = chebyshev.chebpts1(across), chebyshev.chebpts1(along)
    values = np.array([albedo(((x + 1) / 2)**2, 1 / 10**(r - 1)) for r in y])
    of_y = np.linalg.solve(polynomial.polyvander(y, along - 1), values)
    return np.asarray(np.linalg.solve(polynomial.polyvander(x, across - 1), of_y.T))
