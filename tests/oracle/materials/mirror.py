"""Perfect mirror."""

from __future__ import annotations

import numpy as np

from clrt.scene.materials.material_types import Mirror

from ..surface import Surface
from ..vectors import Doubles
from .scattering import Sample, Scattering


class Specular(Scattering):
    def __init__(self, material: Mirror, at: Surface) -> None:
        self._color = at.tinted(material.color)

    def evaluate(self, wo: Doubles, wi: Doubles) -> Doubles:
        return np.zeros_like(wi)

    def sample(self, wo: Doubles, rng: np.random.Generator) -> Sample:
        return Sample(wo * [-1.0, -1.0, 1.0], self._color)
