"""Directional albedo of white sheen fibres in float64, and a polynomial fit of it (kernels/bsdf/sheen.cl)."""

from __future__ import annotations

import numpy as np
from numpy.polynomial import chebyshev, polynomial
from numpy.typing import NDArray

Doubles = NDArray[np.float64]


#: Gauss–Legendre rule, denser at the horizon: cosines and their weights.
NODES, WEIGHTS = np.polynomial.legendre.leggauss(96)
COS_I, WEIGHT = ((NODES + 1) / 2) ** 2, WEIGHTS * (NODES + 1) / 2  # dcos = 2u du


def albedo(cosines: Doubles, n: float) -> Doubles:
    """Return the albedo ∫ D·V·cos wi dωi (m,) at cosines (m,) in (0, 1]."""
    return np.asarray(across(cosines, n) @ WEIGHT)


def bounded_albedo(cosines: Doubles, n: float) -> Doubles:
    """Return the albedo (m,) of D·V divided by the larger of the albedos of wo and wi where that exceeds 1."""
    values, bound = across(cosines, n), np.maximum(albedo(COS_I, n), 1)
    return np.asarray(values / np.maximum((values @ WEIGHT)[:, None], bound) @ WEIGHT)


def across(cosines: Doubles, n: float) -> Doubles:
    """Return D·V·cos wi integrated over the azimuth, (m, 96), at cosines (m,) and COS_I."""
    phi = np.pi * (np.arange(96) + 0.5) / 96
    co, ci = np.asarray(cosines)[:, None, None], COS_I[:, None]
    along = np.sqrt((1 - co**2) * (1 - ci**2)) * np.cos(phi)
    cos_h = (co + ci) / np.sqrt(np.maximum(2 * (1 + co * ci + along), 1e-300))
    d = (2 + n) / (2 * np.pi) * np.maximum(1 - cos_h**2, 0) ** (n / 2)
    return np.asarray(2 * np.pi * (d * ci / (4 * (co + ci - co * ci))).mean(axis=2))


def interpolated(across: int, along: int) -> Doubles:
    """Return (across, along) coefficients in powers of x = 2·√cos − 1 and y = 1 +
    2·log10(roughness), by Chebyshev points.
    """
    x, y = chebyshev.chebpts1(across), chebyshev.chebpts1(along)
    values = np.array([albedo(((x + 1) / 2) ** 2, 1 / 10 ** (r - 1)) for r in y])
    of_y = np.linalg.solve(polynomial.polyvander(y, along - 1), values)
    return np.asarray(np.linalg.solve(polynomial.polyvander(x, across - 1), of_y.T))
