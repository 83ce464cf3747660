"""Cells of the upper hemisphere in which every lobe is smooth, and the integral of a density over them.

A direction wi is charted by its half vector with wo, h = (wo + wi)/|wo + wi|: the azimuth phi of h from wo, and the
logarithm of its slope r = tan θ over the slope at which wi sinks below the horizon. With wo = (s, 0, c) that is the
root of c·r² − 2·r·s·cos phi − c = 0. A mirror-like lobe, around slope 0, and a wide one then both spread over many cells.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]

RADIAL, AZIMUTHAL = 40, 12
LOWEST = np.log(1e-8)
#: Points inside a cell at which a density is summed.
NODES, WEIGHTS = np.polynomial.legendre.leggauss(4)
STEPS = 12


def count(wo: Doubles, wi: Doubles) -> NDArray[np.int64]:
    """(RADIAL·AZIMUTHAL,) how many of the unit vectors wi (n, 3) lie in each cell."""
    h = wo + wi
    azimuth = np.arctan2(h[:, 1], h[:, 0]) - np.arctan2(wo[1], wo[0])
    slope = np.hypot(h[:, 0], h[:, 1]) / h[:, 2]
    depth = np.log(np.maximum(slope / _horizon(wo, azimuth), 1e-30)) / LOWEST
    row = np.clip(depth * RADIAL, 0, RADIAL - 1).astype(np.intp)
    column = np.minimum(azimuth / (2 * np.pi) % 1 * AZIMUTHAL, AZIMUTHAL - 1).astype(np.intp)
    return np.bincount(row * AZIMUTHAL + column, minlength=RADIAL * AZIMUTHAL)


def integrate(density: Callable[[Doubles], Doubles], wo: Doubles) -> Doubles:
    """(RADIAL·AZIMUTHAL,) integrals over solid angle of density(wi (n, 3)) -> (n,) above the horizon."""
    phi = 2 * np.pi * (np.arange(AZIMUTHAL * STEPS) + 0.5) / (AZIMUTHAL * STEPS)
    log_rho = LOWEST * (np.arange(RADIAL)[:, None] + (NODES + 1) / 2).reshape(-1, 1) / RADIAL
    r = np.ravel(np.exp(log_rho) * _horizon(wo, phi))
    azimuth = np.tile(phi, RADIAL * len(NODES)) + np.arctan2(wo[1], wo[0])
    h = np.column_stack([r * np.cos(azimuth), r * np.sin(azimuth), np.ones(len(r))]) / np.sqrt(1 + r * r)[:, None]
    cosine = h @ wo
    # dωi = 4 (wo·h) dωh, and dωh = cos³θ times the area r dr dphi = r² d(log r) dphi of slopes.
    jacobian = 4 * cosine * h[:, 2]**3 * r * r
    values = density(2 * cosine[:, None] * h - wo) * jacobian
    area = -LOWEST / RADIAL / 2 * 2 * np.pi / (AZIMUTHAL * STEPS)
    return np.einsum("rnas,n->ra", values.reshape(RADIAL, len(NODES), AZIMUTHAL, STEPS), WEIGHTS).ravel() * area


def _horizon(wo: Doubles, azimuth: Doubles) -> Doubles:
    """The half vector's slope, at an azimuth from wo, at which wi meets the horizon."""
    b, c = np.hypot(wo[0], wo[1]) * np.cos(azimuth), wo[2]
    root = np.sqrt(b * b + c * c)
    return np.where(b > 0, (b + root) / c, c / (root - np.minimum(b, 0)))
