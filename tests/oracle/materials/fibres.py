"""Sheen, KHR_materials_sheen: color·D·V, D(h) = (2 + n)/2π·sinⁿθh with n = 1/roughness² (Estevez and Kulla 2017,
"Production Friendly Microfacet Sheen BRDF"), V = 1/(4(o + i − o·i)) of the cosines (Neubelt and Pettineo 2013,
"Crafting a Next-Gen Material Pipeline for The Order: 1886").

D·V is divided by the larger of its directional albedos at wo and wi if that exceeds 1. The layer's transmittance is
1 − max(color)·E, with E the directional albedo of the bounded D·V.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from ...rendering import sheen
from ..textures import bilinear
from ..vectors import Doubles
from .scattering import halfway

#: Lower roughness is clamped to this.
SMOOTHEST = 0.1
#: Nodes of the logarithm of roughness from SMOOTHEST to 1, and of the root of the cosine from 0 to 1.
ROUGHNESSES, COSINES = 41, 97


class Fibres:
    """Sheen layers of colours (n, 3) and roughnesses (n,)."""

    def __init__(self, color: Doubles, roughness: Doubles) -> None:
        rough = np.maximum(roughness, SMOOTHEST)
        self.color, self._power = color, rough**-2
        self._row = (1 - np.log(rough) / np.log(SMOOTHEST)) * (ROUGHNESSES - 1)

    def left(self, cosine: Doubles) -> Doubles:
        """Return the transmittance (n,) at cosines (n,)."""
        return np.asarray(1 - self.color.max(axis=1) * self._albedos(cosine)[:, 1])

    def evaluate(self, wo: Doubles, wi: Doubles) -> Doubles:
        """Return f·cos wi (n, 3), 0 below the horizon."""
        up = wi[:, 2] > 0
        o, i = wo[:, 2], np.where(up, wi[:, 2], 1)
        cos_h = halfway(wo, np.where(up[:, None], wi, wo))[:, 2]
        d = (2 + self._power) / (2 * np.pi) * np.maximum(1 - cos_h**2, 0) ** (self._power / 2)
        bound = np.maximum(np.maximum(self._albedos(o)[:, 0], self._albedos(i)[:, 0]), 1)
        return self.color * np.where(up, d * i / (4 * (o + i - o * i) * bound), 0)[:, None]

    def _albedos(self, cosine: Doubles) -> Doubles:
        """Return the albedos (n, 2) of white sheen: of D·V, and of the bounded D·V."""
        found = bilinear(_table(), np.sqrt(np.clip(cosine, 0, 1)) * (COSINES - 1), self._row, "clamp", "clamp")
        return np.column_stack([found[:, 0], np.minimum(found[:, 0], 1) * found[:, 1]])


@cache
def _table() -> Doubles:
    """Return (ROUGHNESSES, COSINES, 2): E, and the bounded E over min(E, 1), which has no kink at E = 1."""
    cosines = np.maximum(np.linspace(0, 1, COSINES), 1e-3) ** 2
    rows = []
    for n in np.geomspace(SMOOTHEST, 1, ROUGHNESSES) ** -2:
        unbounded = sheen.albedo(cosines, n)
        rows.append(np.column_stack([unbounded, sheen.bounded_albedo(cosines, n) / np.minimum(unbounded, 1)]))
    return np.array(rows)


def across(cosine: float, roughness: float) -> tuple[Doubles, Doubles]:
    """Return the reflection of light from an angle by white sheen as a quadrature: outgoing
    cosines (m,) and weights (m, 1)."""
    n, cosines = max(roughness, SMOOTHEST) ** -2, np.array([cosine])
    bound = np.maximum(np.maximum(sheen.albedo(cosines, n), _albedos_there(n)), 1)
    return sheen.COS_I, (sheen.across(cosines, n)[0] * sheen.WEIGHT / bound)[:, None]


@cache
def _albedos_there(n: float) -> Doubles:
    return sheen.albedo(sheen.COS_I, n)
