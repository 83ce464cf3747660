"""The diffuse lobes of metallic_roughness below layers of directional transmittance T.

The coupling is 1 − F(wi·h) (glTF), (1 − F(cos wi))(1 − F(cos wo)), or that of Kelemen and Szirmay-Kalos 2001, "A
Microfacet Based Coupled Specular-Matte BRDF Model", (1 − E(wi))(1 − E(wo))/(1 − mean E) with the directional albedo E
of the dielectric's gloss. The last one includes multiple scattering between microfacets of the metal (Kulla and Conty
2017, "Revisiting Physically Based Shading at Imageworks") in the same lobe, r(wi)·r(wo)/(π·mean r) with
r = body·(1 − E) + metallic·multiple·lost. With layers it is R(wi)·R(wo)/(π·mean R), R = T·r + what min(T(wi), T(wo))
takes from single bounces beyond 1 − T.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from clrt.scene.materials.metallic_roughness import MetallicRoughness

from ..surface import Surface
from ..vectors import Doubles, dot
from .albedo import Albedos
from .layers import Layers
from .scattering import halfway
from .substance import Substance
from .taken import Taken

#: Gauss–Legendre rule for the root of the cosine.
X, WEIGHTS = np.polynomial.legendre.leggauss(16)
ROOTS = (X + 1) / 2

OfCosine = Callable[[Doubles], Doubles]


class Lobe:
    """f(wo)·f(wi)/mean f, with the cosine-weighted hemispherical mean. rows: n."""

    def __init__(self, f: OfCosine, rows: int) -> None:
        self._f = f
        self._mean: Doubles = np.asarray(
            sum(2 * weight * root**3 * f(np.full(rows, root**2)) for root, weight in zip(ROOTS, WEIGHTS))
        )

    def __call__(self, wo: Doubles, wi: Doubles) -> Doubles:
        """Return the lobe (n, c) for f (n, c)."""
        product = self._f(wo[:, 2]) * self._f(wi[:, 2])
        return np.asarray(np.divide(product, self._mean, out=np.zeros_like(product), where=self._mean > 0))


def by_half_vector(substance: Substance, wo: Doubles, wi: Doubles) -> Doubles:
    """Return f·π without layers, (n, 3)."""
    return np.asarray((1 - substance.gloss.at(np.abs(dot(wo, halfway(wo, wi))))) * substance.body)


def by_fresnel(substance: Substance, wo: Doubles, wi: Doubles) -> Doubles:
    """Return f·π without layers, (n, 3)."""
    return np.asarray(
        (1 - substance.gloss.at(wo[:, 2])) * (1 - substance.gloss.at(np.maximum(wi[:, 2], 0))) * substance.body
    )


class ByAlbedo:
    """R, and the energy that single bounces with F = 1 lose."""

    def __init__(self, material: MetallicRoughness, at: Surface, substance: Substance, layers: Layers) -> None:
        self._substance, self._layers = substance, layers
        self._albedos = Albedos(material.smith, at.number(material.roughness))
        self._taken = Taken(material, at) if layers else None
        self._multiple: Doubles = np.zeros_like(substance.color)
        if material.multiple_scattering is not False:
            mean_f, lost = (1 + 20 * substance.color) / 21, 1 - sum(self._albedos.mean())
            self._multiple = substance.metallic * mean_f**2 * (1 - lost) / (1 - mean_f * lost)

    def lost(self, cosine: Doubles) -> Doubles:
        """Return the lost energy (n, 1) at cosines (n,)."""
        return np.asarray(1 - sum(self._albedos.at(cosine)))

    def entering(self, cosine: Doubles) -> Doubles:
        """Return 1 − E (n, 3) at cosines (n,)."""
        return np.asarray(1 - self._substance.dielectric.reflected(self._albedos.at(cosine)))

    def reflected(self, cosine: Doubles) -> Doubles:
        """Return R (n, 3) at cosines (n,)."""
        r = self._substance.body * self.entering(cosine) + self._multiple * self.lost(cosine)
        return np.asarray(self._layers.left(cosine)[:, None] * r + self._given_back(cosine))

    def _given_back(self, cosine: Doubles) -> Doubles | float:
        if self._taken is None:
            return 0.0
        substance, bounce = self._substance, self._taken.from_gloss(cosine)
        found = substance.gloss.reflected(bounce) + substance.passing * substance.dielectric.passed(bounce)
        fibres = self._layers.fibres
        return found + fibres.color * self._taken.from_fibres(cosine) if fibres else found
