"""Excess energy that clearcoat (film) and sheen (fibres) take from the specular lobe (gloss) below, as a table.

A layer transmits the fraction T(c) of light at a cosine c to what lies below. The gloss is scaled by min(T(wo), T(wi)),
which is reciprocal, and exact if it is smooth. For rough gloss this removes more than the layers reflect;
kernels/bsdf/layers.cl adds the difference back:
  taken(co) = ∫ gloss(wo, wi)·(T(co) − T(ci)) dwi  over the wi nearer the horizon, ci < co
With T = (1 − film·E_film)·(1 − fibres·E_fibres) this is a sum over film, fibres and their product, each times the
integral with its albedo E; T decreases where E increases. The film takes from the fibres' reflection in the same way.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .dielectric_energy import microfacets
from .material import ALPHA_MIN
from .microfacets import albedos, shadowing
from .textures import Texture

Doubles = NDArray[np.float64]
Roughnesses = tuple[float, ...]


class Table(tuple[float, ...]):
    """Entries of ENTRY numbers each, stored once for all materials with an equal table; these hold the index of
    its first entry."""


#: Intervals of the angle axis, uniform in √cos.
STEPS = 96
#: Numbers per entry: what film, fibres, and their product take from f0 and from f90 each; what the film takes from
#: fibres; and the reflectance of fibres over the smaller of their unbounded albedo and 1.
ENTRY = 8
#: Rows for a roughness from a texture, uniform in its square root.
ROWS = 12
GRID: Roughnesses = tuple((np.linspace(0, 1, ROWS) ** 2).tolist())
#: Lower limit of fibres' roughness; smoother ones would reflect only at the horizon (kernels/bsdf/sheen.cl).
SMOOTHEST = 0.1
#: √cos at which albedos are tabulated, linear in between.
ROOTS = np.linspace(0, 1, 193)
NEAREST = 1e-3  # lower limit of √cos in integrals
LATTICE = (2584, 1597)


def rows(roughness: float | Texture) -> Roughnesses:
    """Return the roughness itself, or GRID for a texture."""
    return GRID if isinstance(roughness, Texture) else (float(roughness),)


@lru_cache(128)
def tables(base: Roughnesses, film: Roughnesses, fibres: Roughnesses, smith: str = "height_correlated") -> Table:
    """Build the table: for each roughness of the base, of the film (none: (0,)), and of the fibres (none: (1,)) entries
    of cosine-weighted means over the hemisphere, then those of STEPS + 1 angles. smith: the masking term of the gloss.

    The first entry is the mean of the others. The next two hold the means of the albedos of film, fibres, and their
    product, each times 1, by_f0, by_f90 and lost of single scattering at the base (kernels/bsdf/ggx_albedo.cl).
    """
    films = np.array([film_albedo(ROOTS, r) for r in film])
    threads = [Fibres(r) for r in fibres]
    bounded = np.array([each.reflected for each in threads])
    both = films[:, None] * bounded
    table = np.zeros((len(base), len(film), len(fibres), STEPS + 1, ENTRY))
    means = np.zeros((len(base), len(film), len(fibres), 2 * ENTRY))
    for row, mean, roughness in zip(table, means, base):
        below = _bounce(roughness, smith) * _mean_weights(ROOTS)
        for part, albedo in enumerate((films[:, None], bounded, both)):
            mean[..., 4 * part : 4 * part + 4] = albedo @ below.T
        for part, lost in enumerate(taken_from_gloss(roughness, smith)):
            row[..., part] = (films @ lost.T)[:, None]
            row[..., 2 + part] = bounded @ lost.T
            row[..., 4 + part] = both @ lost.T
        for index, each in enumerate(threads):
            row[:, index, :, 6] = films @ each.taken.T
            row[:, index, :, 7] = each.part
    # Within alpha of the horizon single scattering loses so much that the film would take a negative amount.
    table = np.maximum(table, 0)
    weights = _mean_weights(np.linspace(0, 1, STEPS + 1))
    table = np.concatenate([weights[None] @ table, means.reshape(*means.shape[:-1], 2, ENTRY), table], axis=-2)
    return Table(table.astype(np.float32).ravel().tolist())


def _mean_weights(roots: Doubles) -> Doubles:
    """Return weights (n,) for f at `roots`, √c uniform from 0 to 1, that integrate ∫ f·2c dc, f linear in between."""
    steps = 16 * (len(roots) - 1)
    fine = (np.arange(steps) + 0.5) / steps
    return np.array([np.mean(4 * fine**3 * np.interp(fine, roots, one)) for one in np.eye(len(roots))])


def _bounce(roughness: float, smith: str) -> Doubles:
    """Compute (4, len(ROOTS)): 1, and by_f0, by_f90 and lost of single scattering."""
    whole, grazing = albedos(np.maximum(ROOTS, NEAREST) ** 2, max(roughness**2, ALPHA_MIN), smith)
    return np.array([np.ones_like(whole), whole - grazing, grazing, 1 - whole])


def film_albedo(roots: Doubles, roughness: float) -> Doubles:
    """Compute (n,) the single-scattering albedo of a film of F0 0.04 at √cos (n,)."""
    whole, grazing = albedos(np.maximum(roots, NEAREST) ** 2, max(roughness**2, ALPHA_MIN), "height_correlated")
    return np.asarray(0.04 * (whole - grazing) + grazing)


def taken_from_gloss(roughness: float, smith: str) -> tuple[Doubles, Doubles]:
    """Compute (STEPS + 1, len(ROOTS)) twice: what is taken from f0 and f90 per albedo at ROOTS."""
    cosines = np.maximum(np.linspace(0, 1, STEPS + 1), NEAREST) ** 2
    alpha = max(roughness**2, ALPHA_MIN)
    met = microfacets(cosines, alpha, LATTICE)
    grazing = np.maximum(1 - met.cos_o, 0) ** 5
    there = met.cosine, np.maximum(met.back, NEAREST**2), alpha
    seen = met.weight * met.seen * shadowing(*there, smith) / shadowing(*there, "height_correlated")
    return _below(cosines, met.back, seen * (1 - grazing)), _below(cosines, met.back, seen * grazing)


def _below(cosines: Doubles, others: Doubles, weights: Doubles) -> Doubles:
    """Compute the matrix (n, len(ROOTS)), applied to E at ROOTS, of Σ weights·(E(others) − E(cosines)) over the others
    (n, m) below each of the cosines (n,)."""
    weights = np.where((others > 0) & (others < cosines[:, None]), weights, 0)
    matrix = -weights.sum(axis=1, keepdims=True) * _at(cosines[:, None], np.ones((len(cosines), 1)))
    return np.asarray(matrix + _at(np.clip(others, 0, 1), weights))


def _at(cosines: Doubles, weights: Doubles) -> Doubles:
    """Compute the matrix (n, len(ROOTS)), applied to E at ROOTS, of Σ weights·E(cosines), both (n, m)."""
    place = np.sqrt(cosines) * (len(ROOTS) - 1)
    first = np.minimum(place.astype(np.int64), len(ROOTS) - 2)
    across, row = place - first, len(ROOTS) * np.arange(len(cosines))[:, None]
    size = len(cosines) * len(ROOTS)
    counted = (
        np.bincount((row + first + step).ravel(), (weights * part).ravel(), size)
        for step, part in ((0, 1 - across), (1, across))
    )
    return np.asarray(sum(counted)).reshape(len(cosines), len(ROOTS))


class Fibres:
    """White sheen fibres of one roughness.

    reflected: (len(ROOTS),) their albedo, bounded; part: (STEPS + 1,) that over the smaller of their unbounded albedo
    and 1; taken: (STEPS + 1, len(ROOTS)), what a film takes from it per albedo of the film at ROOTS.
    """

    def __init__(self, roughness: float) -> None:
        n = max(roughness, SMOOTHEST) ** -2
        nodes, weights = np.polynomial.legendre.leggauss(64)
        roots = (nodes + 1) / 2
        across = _fibres(roots**2, roots**2, n) @ (weights * roots)
        every = np.union1d(ROOTS, np.linspace(0, 1, STEPS + 1))
        cosines = np.maximum(every, NEAREST) ** 2
        values = _fibres(cosines, roots**2, n) * (weights * roots)
        unbounded = values.sum(axis=1)
        values /= np.maximum(np.maximum(unbounded[:, None], across), 1)
        reflected = values.sum(axis=1)
        self.reflected = reflected[np.isin(every, ROOTS)]
        steps = np.isin(every, np.linspace(0, 1, STEPS + 1))
        self.part = (reflected / np.maximum(np.minimum(unbounded, 1), 1e-30))[steps]
        self.taken = _below(cosines[steps], np.broadcast_to(roots**2, values[steps].shape), values[steps])


def _fibres(cos_o: Doubles, cos_i: Doubles, n: float) -> Doubles:
    """Compute (n, m) the fibres' f·cos wi, integrated over the azimuth, for cosines (n,) and (m,)."""
    o, i = cos_o[:, None], cos_i
    phi = np.pi * (np.arange(64) + 0.5)[:, None, None] / 64
    along = np.sqrt((1 - o**2) * (1 - i**2)) * np.cos(phi)
    sine2 = np.maximum(1 - (o + i) ** 2 / np.maximum(2 * (1 + o * i + along), 1e-300), 0)
    d = (2 + n) / (2 * np.pi) * np.mean(sine2 ** (n / 2), axis=0)
    return np.asarray(2 * np.pi * d * i / (4 * (o + i - o * i)))
