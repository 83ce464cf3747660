"""Clearcoat, KHR_materials_clearcoat: Cook–Torrance with Schlick's F from 0.04 to 1, times its strength.

Its transmittance is 1 − strength·E, with E the directional albedo of its single bounce.
"""

from __future__ import annotations

import numpy as np

from ..vectors import Doubles, dot
from .albedo import Albedos
from .fresnel import schlick
from .ggx import VisibleNormals, alpha_of, reflection
from .scattering import halfway

F0 = 0.04


class Film:
    """Clearcoats of strengths and roughnesses (n,)."""

    def __init__(self, strength: Doubles, roughness: Doubles) -> None:
        self._strength, self._alpha = strength, alpha_of(roughness)
        self._albedos = Albedos("height_correlated", roughness)
        self.strategy = VisibleNormals(self._alpha)

    def left(self, cosine: Doubles) -> Doubles:
        """Return the transmittance (n,) at cosines (n,)."""
        by_f0, by_f90 = self._albedos.at(cosine)
        return 1 - self._strength * (F0 * by_f0 + by_f90)[:, 0]

    def evaluate(self, wo: Doubles, wi: Doubles) -> Doubles:
        """Return f·cos wi, (n, 1)."""
        f0, f90 = np.full((len(wo), 1), F0), np.ones((len(wo), 1))
        fresnel = schlick(np.abs(dot(wo, halfway(wo, wi))), f0, f90)[:, 0]
        return np.asarray(self._strength * fresnel * reflection(wo, wi, self._alpha))[:, None]
