"""Lambert's law: f = color/π."""

from __future__ import annotations

import numpy as np

from clrt.scene.materials.material_types import Diffuse

from ..surface import Surface
from ..vectors import Doubles
from .scattering import Cosine, Mixed


class Lambertian(Mixed):
    def __init__(self, material: Diffuse, at: Surface) -> None:
        self._albedo = at.tinted(material.color)
        self.strategies = [Cosine()]

    def evaluate(self, wo: Doubles, wi: Doubles) -> Doubles:
        return self._albedo * np.maximum(wi[:, 2:], 0) / np.pi
