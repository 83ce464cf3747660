"""Directional albedo of a single bounce at an anisotropic GGX surface, as a table for kernels.

With roughnesses alpha_t and alpha_b along two axes the albedo depends on the azimuth, too, for which there are no fits
(kernels/bsdf/ggx_albedo.cl). The table holds the same two quantities, lost and by_f90, at two coordinates in which they
are smooth for all roughnesses:
  t = √(q·(1 + width)), q = c/(c + width), width = 2·√alpha_φ      of the cosine c
  u = log(alpha_φ/alpha_b)/log(alpha_t/alpha_b)                    of the azimuth φ
alpha_φ² = alpha_t²·cos² φ + alpha_b²·sin² φ is the roughness that masks light from the azimuth φ. by_f90 is stored as
g − c with by_f90 = (1 − lost)·(1 − g)^5.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .layer_energy import ENTRY, Table
from .material import ALPHA_MIN

Doubles = NDArray[np.float64]

#: Intervals of t and of u. An entry of the table has the corners of one cell: four times lost, four times g − c.
STEPS, AZIMUTHS = 32, 12
#: Rows per roughness if one of them comes from a texture, uniform in its cube root.
ROWS = 10
#: A Fibonacci lattice: the number of points, and the previous Fibonacci number.
LATTICE = (610, 377)
TINY = 1e-150


class Row(NamedTuple):
    """mean: of lost and by_f90 over the hemisphere, weighted by cosines; values: (STEPS + 1, AZIMUTHS + 1, 2), lost and
    g − c."""

    mean: Doubles
    values: Doubles


@lru_cache(128)
def tables(roughness: float | None, anisotropy: float | None) -> Table:
    """Build the table of a material: an entry of means, (lost, by_f90, 0, ...), then the cells, by t and then by u.

    A parameter that comes from a texture is None: then one such row for each pair of ROWS values of alpha_t and
    alpha_b.
    """
    if roughness is not None and anisotropy is not None:
        return Table(_entries(_row(*alphas(roughness, anisotropy))))
    grid = [max(float(root) ** 3, ALPHA_MIN) for root in np.linspace(0, 1, ROWS)]
    rows = {(t, b): _row(t, b) for t in grid for b in grid if b <= t}
    # If alpha_t is the smaller one, u runs the other way. Such rows are interpolated next to the diagonal.
    rows |= {(b, t): Row(row.mean, row.values[:, ::-1]) for (t, b), row in rows.items() if b < t}
    return Table(number for t in grid for b in grid for number in _entries(rows[t, b]))


def alphas(roughness: float, anisotropy: float) -> tuple[float, float]:
    """Return alpha_t and alpha_b (KHR_materials_anisotropy)."""
    alpha = max(roughness**2, ALPHA_MIN)
    return alpha + (1 - alpha) * anisotropy**2, alpha


def albedos(cosines: Doubles, azimuths: Doubles, alpha_t: float, alpha_b: float) -> tuple[Doubles, Doubles]:
    """Compute lost and by_f90 (n,) at cosines and azimuths (n,), by sampling of visible normals."""
    sines = np.sqrt(1 - cosines**2)
    wx, wy, wz = (each[:, None] for each in (sines * np.cos(azimuths), sines * np.sin(azimuths), cosines))
    length = np.sqrt((alpha_t * wx) ** 2 + (alpha_b * wy) ** 2 + wz**2)
    turn_x, turn_y, height, weight = _lattice()
    up = 1 - height * (1 + wz / length)
    radius = np.sqrt(np.maximum(1 - up**2, 0))
    hx, hy = alpha_t * (radius * turn_x + alpha_t * wx / length), alpha_b * (radius * turn_y + alpha_b * wy / length)
    hz = np.maximum(up + wz / length, 1e-30)
    norm2 = hx * hx + hy * hy + hz * hz
    along = wx * hx + wy * hy + wz * hz
    x, y, z = (2 * along / norm2 * h - w for h, w in ((hx, wx), (hy, wy), (hz, wz)))
    one_o = length / wz  # 1 + 2·Lambda
    one_i = np.sqrt(1 + ((alpha_t * x) ** 2 + (alpha_b * y) ** 2) / np.maximum(z, TINY) ** 2)
    seen = np.where(z > 0, (1 + one_o) / (one_o + one_i), 0) * weight
    far = np.maximum(1 - along / np.sqrt(norm2), 0)
    far2 = far * far
    return 1 - seen.sum(axis=1), np.sum(seen * (far2 * far2 * far), axis=1)


@lru_cache(1)
def _lattice() -> tuple[Doubles, Doubles, Doubles, Doubles]:
    """Return the samples' azimuths, as cosine and sine, their heights from 0 to 1, and their weights; each (points,).

    A tent map places more samples at steep normals, see dielectric_energy.
    """
    points, generator = LATTICE
    i = np.arange(points)
    turn, tent = 2 * np.pi * (i + 0.5) / points, np.abs(2 * ((i * generator + 0.25) / points % 1) - 1)
    return np.cos(turn), np.sin(turn), 1 - tent**2, 2 * tent / points


def _row(alpha_t: float, alpha_b: float) -> Row:
    """Compute the albedos of alpha_t ≥ alpha_b."""
    u = np.linspace(0, 1, AZIMUTHS + 1)
    masking = alpha_b * (alpha_t / alpha_b) ** u
    cos2 = (masking**2 - alpha_b**2) / max(alpha_t**2 - alpha_b**2, TINY)
    azimuths = np.arccos(np.sqrt(np.clip(cos2, 0, 1)))
    width = 2 * np.sqrt(masking)
    q = np.linspace(0, 1, STEPS + 1)[:, None] ** 2 / (1 + width)
    cosines = np.clip(width * q / (1 - q), 1e-6 * alpha_b, 1)
    # A part at a time, which stays in the processor's cache.
    lost, by_f90 = np.array([albedos(each, azimuths, alpha_t, alpha_b) for each in cosines]).transpose(1, 0, 2)
    g = 1 - (np.maximum(by_f90, 0) / np.maximum(1 - lost, TINY)) ** 0.2
    values = np.stack([lost, g - cosines], axis=-1)
    return Row(_mean(values, alpha_t, alpha_b), values)


def _mean(values: Doubles, alpha_t: float, alpha_b: float) -> Doubles:
    """Compute (2,) the means of lost and by_f90, as interpolated."""
    azimuths, roots = (np.arange(64) + 0.5) / 64 * np.pi / 2, (np.arange(256) + 0.5) / 256
    azimuth, cosine = (each.ravel() for each in np.meshgrid(azimuths, roots**2))
    found = np.array(interpolated(values, cosine, azimuth, alpha_t, alpha_b)).reshape(2, 256, 64)
    return np.asarray(found.mean(axis=2) @ (4 * roots**3) / 256)


def interpolated(
    values: Doubles, cosines: Doubles, azimuths: Doubles, alpha_t: float, alpha_b: float
) -> tuple[Doubles, Doubles]:
    """Look up lost and by_f90 (n,) at cosines and azimuths (n,), as the kernels do."""
    masking = np.sqrt((alpha_t * np.cos(azimuths)) ** 2 + (alpha_b * np.sin(azimuths)) ** 2)
    spread = np.log(alpha_t / alpha_b)
    u = AZIMUTHS * (np.log(masking / alpha_b) / spread if spread > 0 else np.zeros_like(masking))
    width = 2 * np.sqrt(masking)
    t = STEPS * np.sqrt(cosines / (cosines + width) * (1 + width))
    i, j = t.astype(int).clip(0, STEPS - 1), u.astype(int).clip(0, AZIMUTHS - 1)
    down, across = (t - i)[:, None], (u - j)[:, None]
    upper, lower = (values[row, j] + across * (values[row, j + 1] - values[row, j]) for row in (i, i + 1))
    lost, bend = (upper + down * (lower - upper)).T
    return lost, (1 - lost) * np.maximum(1 - cosines - bend, 0) ** 5


def _entries(row: Row) -> list[float]:
    """Return an entry of means, and one of each cell's corners."""
    corners = [row.values[i : STEPS + i, j : AZIMUTHS + j] for i in (0, 1) for j in (0, 1)]
    cells = np.stack(corners, axis=-1).reshape(-1, ENTRY)
    first = np.zeros((1, ENTRY))
    first[0, :2] = row.mean
    return np.concatenate([first, cells]).astype(np.float32).ravel().tolist()
