"""Partition of the sphere into cells in which every lobe is smooth, and integrals of a density over them.

A direction wi above the surface is parametrized by its half vector with wo, h = (wo + wi)/|wo + wi|: the logarithm of
h's slope r = tan θ and its azimuth from wo. Both a mirror-like lobe, around slope 0, and a wide one then spread over
many cells. A direction below the surface is parametrized likewise, mirrored, or by the logarithm of its angle to a
center where its lobe concentrates, and the azimuth around that center from upwards.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]

#: Rows of cells in log r, columns in azimuth; smaller slopes than the lowest row's count to it.
ROWS, COLUMNS = 52, 12
LOWEST, HIGHEST = np.log(1e-7), np.log(1e4)
#: Gauss–Legendre points per cell in log r; TURNS are those in azimuth.
NODES, WEIGHTS = np.polynomial.legendre.leggauss(4)
#: More points, for pdfs with discontinuities in a cell: total internal reflection, or microfacets becoming invisible.
MANY = np.polynomial.legendre.leggauss(24)
TURNS, TURN_WEIGHTS = np.polynomial.legendre.leggauss(32)


def count(wo: Doubles, wi: Doubles) -> NDArray[np.int64]:
    """Count the unit vectors wi (n, 3) in each cell, (ROWS·COLUMNS,)."""
    x, y, z = wi.T
    # Near ±1, an ulp of x is as large as the width of a narrow lobe at grazing wo; y and z are more accurate.
    exact_x = np.where(np.abs(x) > 0.9, np.copysign(np.sqrt(np.maximum(1 - y * y - z * z, 0)), x), x)
    h = wo + np.column_stack([exact_x, y, z])
    turn = (np.arctan2(h[:, 1], h[:, 0]) - np.arctan2(wo[1], wo[0])) / (2 * np.pi)
    slope = np.maximum(np.hypot(h[:, 0], h[:, 1]) / h[:, 2], 1e-30)
    row = np.clip((np.log(slope) - LOWEST) / (HIGHEST - LOWEST) * ROWS, 0, ROWS - 1).astype(np.intp)
    column = np.minimum(turn % 1 * COLUMNS, COLUMNS - 1).astype(np.intp)
    return np.bincount(row * COLUMNS + column, minlength=ROWS * COLUMNS)


def integrate(density: Callable[[Doubles], Doubles], wo: Doubles, edged: bool = False) -> Doubles:
    """Integrate density(wi (n, 3)) -> (n,) over solid angle above the horizon, for each cell, (ROWS·COLUMNS,)."""
    nodes, weights = MANY if edged else (NODES, WEIGHTS)
    # At grazing wo the horizon bends within about that angle of azimuth 90°, a column's edge: cluster points there.
    inside, weight = (2 + TURNS * (3 - TURNS**2)) / 4, 0.75 * (1 - TURNS**2) * TURN_WEIGHTS
    phi = np.add.outer(np.arange(COLUMNS), inside).ravel() * 2 * np.pi / COLUMNS
    edges = np.minimum(np.linspace(LOWEST, HIGHEST, ROWS + 1)[:, None], _log_horizon(wo, phi))
    low, width = edges[:-1, None], (edges[1:] - edges[:-1])[:, None]
    r = np.exp(low + width * (nodes[:, None] + 1) / 2).ravel()
    azimuth = np.tile(phi, ROWS * len(nodes)) + np.arctan2(wo[1], wo[0])
    h = np.column_stack([r * np.cos(azimuth), r * np.sin(azimuth), np.ones(len(r))]) / np.sqrt(1 + r * r)[:, None]
    cosine = h @ wo
    # dωi = 4 (wo·h) dωh, and dωh = cos³θ times the area of slopes r dr dphi = r² d(log r) dphi.
    jacobian = 4 * cosine * h[:, 2] ** 3 * r * r
    values = density(2 * cosine[:, None] * h - wo) * jacobian
    parts = values.reshape(ROWS, len(nodes), COLUMNS * len(TURNS)) * width * weights[:, None] / 2
    sums = parts.sum(axis=1).reshape(ROWS, COLUMNS, len(TURNS)) @ weight
    return np.asarray(sums.ravel() * 2 * np.pi / COLUMNS)


#: Rows of the cells below, in the logarithm of the angle; smaller angles than the lowest row's count to it.
ROWS_BELOW = 48
NEAREST, FARTHEST = np.log(1e-6), np.log(np.pi)


def count_below(center: Doubles, wi: Doubles) -> NDArray[np.int64]:
    """Count the unit vectors wi (n, 3) below the surface in each cell around a center, (ROWS_BELOW·COLUMNS,)."""
    up, side = _around(center)
    angle = 2 * np.arcsin(np.minimum(np.linalg.norm(wi - center, axis=1) / 2, 1))
    turn = np.arctan2(wi @ side, wi @ up) / (2 * np.pi)
    row = (np.log(np.maximum(angle, 1e-30)) - NEAREST) / (FARTHEST - NEAREST) * ROWS_BELOW
    column = np.minimum(turn % 1 * COLUMNS, COLUMNS - 1).astype(np.intp)
    cells = np.clip(row, 0, ROWS_BELOW - 1).astype(np.intp) * COLUMNS + column
    return np.bincount(cells, minlength=ROWS_BELOW * COLUMNS)


def integrate_below(density: Callable[[Doubles], Doubles], center: Doubles) -> Doubles:
    """Integrate density(wi (n, 3)) -> (n,) over solid angle below the horizon, for each cell, (ROWS_BELOW·COLUMNS,)."""
    nodes, weights = MANY
    up, side = _around(center)
    phi = np.add.outer(np.arange(COLUMNS), (TURNS + 1) / 2).ravel() * 2 * np.pi / COLUMNS
    outwards = np.cos(phi)[:, None] * up + np.sin(phi)[:, None] * side
    horizon = np.log(np.arctan2(-center[2], outwards[:, 2]))
    edges = np.minimum(np.linspace(NEAREST, FARTHEST, ROWS_BELOW + 1)[:, None], horizon)
    edges[0] = -30
    low, width = edges[:-1, None], (edges[1:] - edges[:-1])[:, None]
    angle = np.exp(low + width * (nodes[:, None] + 1) / 2)[..., None]
    wi = (np.cos(angle) * center + np.sin(angle) * outwards).reshape(-1, 3)
    values = density(wi).reshape(angle.shape[:3]) * (np.sin(angle) * angle)[..., 0]
    sums = (values * width * weights[:, None] / 2).sum(axis=1).reshape(ROWS_BELOW, COLUMNS, len(TURNS))
    return np.asarray((sums @ (TURN_WEIGHTS / 2)).ravel() * 2 * np.pi / COLUMNS)


def _around(center: Doubles) -> tuple[Doubles, Doubles]:
    """Return unit vectors that form a right-handed frame with a center below: upwards, and horizontal."""
    level = np.hypot(center[0], center[1])
    side = np.array([center[1], -center[0], 0.0]) / level if level > 0 else np.array([0.0, 1.0, 0.0])
    return np.cross(side, center), side


def _log_horizon(wo: Doubles, azimuth: Doubles) -> Doubles:
    """Return log r where wi reaches the horizon: the root of c·r² − 2·r·s·cos(azimuth) − c = 0 for wo = (s, 0, c)."""
    b, c = np.hypot(wo[0], wo[1]) * np.cos(azimuth), wo[2]
    root = np.sqrt(b * b + c * c)
    return np.asarray(np.log(np.where(b > 0, (b + root) / c, c / (root - np.minimum(b, 0)))))
