"""Dispersion of smooth glass: one index of refraction per channel, of which a path follows a random one.

The indices are those of KHR_materials_dispersion: ior ∓ (ior − 1)·0.025·dispersion for red and blue.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from clrt.scene.materials.material_types import Dielectric

from ..surface import Surface
from ..vectors import Doubles
from .dielectric import Glass
from .scattering import Sample, Scattering


class DispersiveGlass(Scattering):
    def __init__(self, material: Dielectric, at: Surface) -> None:
        spread = (material.ior - 1) * 0.025 * material.dispersion
        iors = [material.ior + sign * spread for sign in (-1, 0, 1)]
        self._channels = [Glass(replace(material, ior=ior, dispersion=0.0), at) for ior in iors]
        self.absorption_beyond = self._channels[0].absorption_beyond

    def evaluate(self, wo: Doubles, wi: Doubles) -> Doubles:
        return np.zeros_like(wo)

    def sample(self, wo: Doubles, rng: np.random.Generator) -> Sample:
        chosen = rng.integers(3, size=len(wo))
        each = [channel.sample(wo, rng) for channel in self._channels]
        wi = np.array([sample.wi for sample in each])[chosen, np.arange(len(wo))]
        weight = np.column_stack([sample.weight[:, i] for i, sample in enumerate(each)])
        return Sample(wi, 3 * weight * np.eye(3)[chosen])


def glass(material: Dielectric, at: Surface) -> Scattering:
    """Return the scattering of glass with or without dispersion."""
    return DispersiveGlass(material, at) if material.dispersion else Glass(material, at)
