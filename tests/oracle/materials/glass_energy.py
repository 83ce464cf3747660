"""Energy lost by a single bounce at rough glass, by quadrature, and the distribution of later bounces.

The single bounce is divided by 1 − min(loss(wo), loss(wi)), the larger of both directional albedos, in the manner of
Turquin 2019, "Practical Multiple Scattering Compensation for Microfacet Models"; the remaining energy leaves by the
lobe of Kulla and Conty 2017, "Revisiting Physically Based Shading at Imageworks", rest(wo)·rest(wi)/(π·m).
"""

from __future__ import annotations

from functools import cache

import numpy as np

from ..textures import bilinear
from ..vectors import Bools, Doubles, dot
from . import fresnel
from .ggx import alpha_of, smith_lambda, visible_nodes
from .scattering import reflected

#: Nodes of roughness from ROUGHNESS to 1 and of the cosine's root from 0 to 1, and of each random number of a normal.
NODES, NORMALS = 33, 48
#: Lower roughness is not in the tables.
ROUGHNESS = 0.25


class Energy:
    """Glass of one index at roughnesses (n,); a thin sheet spreads to both sides what a mirror reflects."""

    def __init__(self, ior: float, thin: bool, roughness: Doubles) -> None:
        assert roughness.min(initial=1.0) >= ROUGHNESS
        self._table, self._row = _table(ior, thin), (roughness - ROUGHNESS) / (1 - ROUGHNESS) * (NODES - 1)

    def at(self, cosine: Doubles, outside: Bools) -> tuple[Doubles, Doubles]:
        """Return loss and rest (n,) at these angles on this side."""
        column = np.sqrt(np.clip(cosine, 0, 1)) * (NODES - 1)
        found = bilinear(self._table[:, :NODES], column, self._row, "clamp", "clamp")
        return np.where(outside, found[:, 0], found[:, 2]), np.where(outside, found[:, 1], found[:, 3])

    def mean_rest(self, outside: Bools) -> tuple[Doubles, Doubles]:
        """Return ∫ rest·2c dc (n,) on this side and on the other."""
        found = bilinear(self._table[:, NODES:], np.zeros_like(self._row), self._row, "clamp", "clamp")
        return np.where(outside, found[:, 1], found[:, 3]), np.where(outside, found[:, 3], found[:, 1])


@cache
def _table(ior: float, thin: bool) -> Doubles:
    """Return the table (roughnesses, cosines, 4) of loss and rest outside, then inside, with means in the last
    column."""
    x, weights = np.polynomial.legendre.leggauss(4 * NODES)
    between = (x + 1) / 2
    nodes, rows = np.linspace(0, 1, NODES), []
    for alpha in alpha_of(np.linspace(ROUGHNESS, 1, NODES)):
        sides = _sides(ior, thin, alpha)
        means = [np.interp(between, nodes, side) @ (2 * weights * between**3) for side in sides.T]
        rows.append(np.vstack([sides, means]))
    return np.array(rows)


def _sides(ior: float, thin: bool, alpha: float) -> Doubles:
    """Return loss and rest (cosines, 4) of one roughness."""
    roots, etas = np.linspace(0, 1, NODES), [np.inf] if thin else [ior, 1 / ior]
    bounces = [[_bounce(max(root, 1e-3) ** 2, alpha, eta) for root in roots] for eta in etas]
    losses = [np.array([1 - back.sum() - on.sum() for back, on, _, _ in side]) for side in bounces]
    found = []
    for side, own, other in zip(bounces, losses, losses[::-1]):
        kept = [
            sum(
                np.sum(part / (1 - np.minimum(loss, np.interp(np.sqrt(np.maximum(cosine, 0)), roots, beyond))))
                for part, cosine, beyond in ((back, cos_back, own), (on, cos_on, other))
            )
            for (back, on, cos_back, cos_on), loss in zip(side, own)
        ]
        found += [own, np.maximum(1 - np.array(kept), 0)]
    return np.array(found if len(found) == 4 else found * 2).T


def _bounce(cosine: float, alpha: float, eta: float) -> tuple[Doubles, Doubles, Doubles, Doubles]:
    """Return the reflected and transmitted shares per visible normal, of 1 in total, and the outgoing cosines."""
    wo, h, share = visible_nodes(cosine, alpha, NORMALS)
    cos_o = np.clip(dot(wo, h), 1e-12, 1)
    if eta == np.inf:
        f, cos_on = np.ones_like(cos_o), np.zeros_like(cos_o)
    else:
        f, cos_t = fresnel.dielectric(cos_o, np.full_like(cos_o, eta))
        cos_on = cosine / eta - (cos_o / eta - cos_t) * h[:, 2]
    cos_back = reflected(wo, h)[:, 2]
    return f * share * _seen(cosine, cos_back, alpha), (1 - f) * share * _seen(cosine, cos_on, alpha), cos_back, cos_on


def _seen(cosine: float, leaving: Doubles, alpha: float) -> Doubles:
    """Return G2/G1, 0 on the wrong side."""
    own, other = smith_lambda(np.array(cosine), np.array(alpha)), smith_lambda(leaving, np.array(alpha))
    return np.where(leaving > 0, (1 + own) / (1 + own + other), 0)
