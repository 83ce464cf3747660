"""Energy-conserving forms of Phong's and Blinn's models: Lafortune and Willems 1994, "Using the modified Phong
reflectance model for physically based rendering"; Giesen 2009, "Phong and Blinn-Phong Normalization Factors".

f = body/π + specular·N·cosⁿ with the body at most 1 − specular.
"""

from __future__ import annotations

import numpy as np

from clrt.scene.materials.material_types import BlinnPhong, Phong

from ..surface import Surface
from ..vectors import Doubles, Frame, dot
from .scattering import Cosine, Mixed, halfway, power_directions, reflected


class Glossy(Mixed):
    """Base class of both models."""

    def __init__(self, material: Phong, at: Surface) -> None:
        self._specular, self._n = at.color(material.specular), material.shininess
        self._body = np.minimum(at.tinted(material.color), 1 - self._specular)

    def lobe(self, wo: Doubles, wi: Doubles) -> Doubles:
        """Return N·cosⁿ, (n,)."""
        raise NotImplementedError

    def evaluate(self, wo: Doubles, wi: Doubles) -> Doubles:
        f = self._body / np.pi + self._specular * self.lobe(wo, wi)[:, None]
        return f * np.maximum(wi[:, 2:], 0)


class PhongGloss(Glossy):
    """Phong's lobe, of the cosine between wi and the mirrored wo."""

    def __init__(self, material: Phong, at: Surface) -> None:
        super().__init__(material, at)
        self.strategies = [AroundMirrored(self._n), Cosine()]

    def lobe(self, wo: Doubles, wi: Doubles) -> Doubles:
        cosine = np.maximum(dot(wo * [-1.0, -1.0, 1.0], wi), 0)
        return np.asarray((self._n + 2) / (2 * np.pi) * cosine**self._n)


class BlinnGloss(Glossy):
    """Blinn's lobe, of the cosine between the normal and the half vector."""

    def __init__(self, material: BlinnPhong, at: Surface) -> None:
        super().__init__(material, at)
        self.strategies = [AtPowerNormals(self._n), Cosine()]

    def lobe(self, wo: Doubles, wi: Doubles) -> Doubles:
        n, cosine = self._n, np.clip(halfway(wo, wi)[:, 2], 0, 1)
        return np.asarray((n + 2) * (n + 4) / (8 * np.pi * (2 ** (-n / 2) + n)) * cosine**n)


class AroundMirrored:
    """Sampling by a power of the cosine to the mirrored wo."""

    def __init__(self, n: float) -> None:
        self._n = n

    def draw(self, wo: Doubles, rng: np.random.Generator) -> Doubles:
        return Frame(wo * [-1.0, -1.0, 1.0]).to_world(power_directions(self._n, rng.random((len(wo), 2))))

    def density(self, wo: Doubles, wi: Doubles) -> Doubles:
        cosine = dot(wo * [-1.0, -1.0, 1.0], wi)
        return np.where(cosine > 0, (self._n + 1) / (2 * np.pi) * np.maximum(cosine, 0) ** self._n, 0)


class AtPowerNormals:
    """Reflection at normals sampled by a power of their cosine."""

    def __init__(self, n: float) -> None:
        self._n = n

    def draw(self, wo: Doubles, rng: np.random.Generator) -> Doubles:
        return reflected(wo, power_directions(self._n, rng.random((len(wo), 2))))

    def density(self, wo: Doubles, wi: Doubles) -> Doubles:
        h = halfway(wo, wi)
        h = np.where(h[:, 2:] < 0, -h, h)
        d, cosine = (self._n + 1) / (2 * np.pi) * h[:, 2] ** self._n, dot(wo, h)
        return np.divide(d, 4 * cosine, out=np.zeros_like(d), where=cosine > 1e-12)
