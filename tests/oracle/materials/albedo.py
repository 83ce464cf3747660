"""Directional albedos of a single GGX bounce with Schlick's F, f0·by_f0 + f90·by_f90, by quadrature."""

from __future__ import annotations

from functools import cache

import numpy as np

from ..textures import bilinear
from ..vectors import Doubles, dot
from .ggx import alpha_of, shadowing, smith_lambda, visible_nodes
from .scattering import reflected

#: Nodes of roughness from ROUGHNESS to 1 and of the cosine's root from 0 to 1, and of each
#: random number of a direction.
NODES, DIRECTIONS = 49, 40
#: Lower roughness is not in the tables.
ROUGHNESS = 0.25


class Albedos:
    """Albedos for one form of masking and shadowing at roughnesses (n,)."""

    def __init__(self, smith: str, roughness: Doubles) -> None:
        assert roughness.min(initial=1.0) >= ROUGHNESS
        self._table, self._row = _table(smith), (roughness - ROUGHNESS) / (1 - ROUGHNESS) * (NODES - 1)

    def at(self, cosine: Doubles) -> tuple[Doubles, Doubles]:
        """Return by_f0 and by_f90, (n, 1) each, at cosines (n,)."""
        column = np.sqrt(np.clip(cosine, 0, 1)) * (NODES - 1)
        found = bilinear(self._table[:, :NODES], column, self._row, "clamp", "clamp")
        return found[:, :1], found[:, 1:]

    def mean(self) -> tuple[Doubles, Doubles]:
        """Return the cosine-weighted hemispherical means of both, (n, 1) each."""
        found = bilinear(self._table[:, NODES:], np.zeros_like(self._row), self._row, "clamp", "clamp")
        return found[:, :1], found[:, 1:]


@cache
def _table(smith: str) -> Doubles:
    """Return the table (roughnesses, cosines, 2) of by_f0 and by_f90, with the means in the last columns."""
    x, weights = np.polynomial.legendre.leggauss(NODES)
    roots = np.append(np.maximum(np.linspace(0, 1, NODES), 1e-3), (x + 1) / 2)
    rows = []
    for alpha in alpha_of(np.linspace(ROUGHNESS, 1, NODES)):
        row = np.array([bounces(root**2, alpha, smith)[1].sum(axis=0) for root in roots])
        # With the cosine c = root², the weight 2·c·dc is 4·root³·droot.
        mean = (weights / 2 * 4 * roots[NODES:] ** 3) @ row[NODES:]
        rows.append(np.vstack([row[:NODES], mean]))
    return np.array(rows)


def bounces(cosine: float, alpha: float, smith: str) -> tuple[Doubles, Doubles]:
    """Return the reflection of light from an angle as a quadrature: outgoing cosines (m,) and
    weights (m, 2) by f0 and f90.
    """
    wo, h, share = visible_nodes(cosine, alpha, DIRECTIONS)
    alphas, cos_i = np.full(len(wo), alpha), reflected(wo, h)[:, 2]
    up = cos_i > 0
    seen = shadowing(wo[:, 2], np.where(up, cos_i, 1), alphas, smith)
    weight = share * np.where(up, seen * (1 + smith_lambda(wo[:, 2], alphas)), 0)  # G2/G1
    grazing = np.maximum(1 - dot(wo, h), 0) ** 5
    return np.maximum(cos_i, 0), weight[:, None] * np.column_stack([1 - grazing, grazing])
