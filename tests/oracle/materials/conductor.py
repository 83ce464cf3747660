"""Conductor with a complex index of refraction and microfacets: F·D·G/(4·cos·cos), one bounce."""

from __future__ import annotations

import numpy as np

from clrt.scene.materials.material_types import Conductor
from clrt.scene.materials.presets import CONDUCTORS

from ..surface import Surface
from ..vectors import Doubles, dot
from .fresnel import conductor
from .ggx import VisibleNormals, alpha_of
from .microfacets import reflection
from .scattering import Cosine, Mixed, halfway


class Metal(Mixed):
    def __init__(self, material: Conductor, at: Surface) -> None:
        eta, k = CONDUCTORS[material.preset]
        self._eta, self._k = np.array(material.eta or eta), np.array(material.k or k)
        self._reflectance = at.color(material.reflectance)
        self._alpha = alpha_of(at.number(material.roughness))
        self._facets = material.distribution, material.smith
        self.strategies = [VisibleNormals(self._alpha), Cosine()]

    def evaluate(self, wo: Doubles, wi: Doubles) -> Doubles:
        fresnel = conductor(np.abs(dot(wo, halfway(wo, wi))), self._eta, self._k)
        return self._reflectance * fresnel * reflection(wo, wi, self._alpha, *self._facets)[:, None]
