"""glTF 2.0's metallic-roughness material (its specification, appendix B), with KHR_materials_ior, _specular,
_transmission and _diffuse_transmission, below a clearcoat and sheen (see layers).

    f = F(wi·h)·D·G/(4·cos·cos) + coupling·body/π,  body = (1 − metallic)·(1 − transmission)·color

F is Schlick's, between F0 (of the dielectric and `color`, mixed by `metallic`) and F90; for the coupling see there.
With passing = (1 − metallic)·transmission·color a sheet transmits passing·(1 − F(wi·h))·D·G/(4·cos·cos), with F of the
dielectric and wi mirrored to wo's side; with the albedo coupling also passing·lost(wi)·lost(wo)/(π·mean lost), the
energy that single bounces lose. The body of a leaf transmits leaf·s(wi)·s(wo)/(π·mean s), s = 1 − E, E of the
dielectric's gloss.

Below layers of transmittance T, single bounces are weighted by min(T(wi), T(wo)), and a diffuse lobe
f(wi)·f(wo)/mean f becomes that of f·T.
"""

from __future__ import annotations

import numpy as np

from clrt.scene.materials.metallic_roughness import MetallicRoughness

from ..surface import Surface
from ..vectors import Doubles, dot
from .coupling import ByAlbedo, Lobe, by_fresnel, by_half_vector
from .ggx import VisibleNormals, reflection
from .layers import layers_of
from .scattering import Cosine, Mixed, Through, halfway, mirrored_below
from .substance import Substance


class CookTorrance(Mixed):
    def __init__(self, material: MetallicRoughness, at: Surface) -> None:
        self._of, self._layers, rows = Substance(material, at), layers_of(material, at), len(at.p)
        self.strategies = [VisibleNormals(self._of.alpha), Cosine(), *self._layers.strategies]
        if material.transmission != 0:
            self.strategies += [Through(VisibleNormals(self._of.alpha)), Through(Cosine())]
        self._coupling, self._scattered, self._leaf = None, None, None
        if material.coupled_by == "albedo":
            albedo = ByAlbedo(material, at, self._of, self._layers)
            self._diffuse = Lobe(albedo.reflected, rows)
            if material.transmission != 0 and material.multiple_scattering is not False:
                self._scattered = Lobe(lambda cosine: self._left(cosine) * albedo.lost(cosine), rows)
            if material.diffuse_transmission != 0:
                self._leaf = Lobe(lambda cosine: self._left(cosine) * albedo.entering(cosine), rows)
                self.strategies.append(Through(Cosine()))
        else:
            assert not material.multiple_scattering
            self._diffuse = Lobe(self._left, rows)
            self._coupling = by_fresnel if material.coupled_by == "fresnel" else by_half_vector

    def evaluate(self, wo: Doubles, wi: Doubles) -> Doubles:
        up = wi[:, 2:] > 0
        above = np.where(up, wi, mirrored_below(wi))
        return np.where(up, self._reflected(wo, above), self._passed(wo, above))

    def _reflected(self, wo: Doubles, wi: Doubles) -> Doubles:
        gloss = self._of.gloss.at(dot(wo, halfway(wo, wi))) * self._facets(wo, wi)
        coupling = self._coupling(self._of, wo, wi) if self._coupling else 1.0
        return gloss + self._diffuse(wo, wi) * coupling * wi[:, 2:] / np.pi + self._layers.evaluate(wo, wi)

    def _passed(self, wo: Doubles, wi: Doubles) -> Doubles:
        once = (1 - self._of.dielectric.at(dot(wo, halfway(wo, wi)))) * self._facets(wo, wi)
        again = self._scattered(wo, wi) * wi[:, 2:] / np.pi if self._scattered else 0.0
        leaf = self._leaf(wo, wi) * wi[:, 2:] / np.pi if self._leaf else 0.0
        return self._of.passing * (once + again) + self._of.leaf * leaf

    def _facets(self, wo: Doubles, wi: Doubles) -> Doubles:
        """Return D·G/(4·cos) below layers, (n, 1)."""
        left = np.minimum(self._left(wo[:, 2]), self._left(wi[:, 2]))
        return np.asarray(left * reflection(wo, wi, self._of.alpha, self._of.smith)[:, None])

    def _left(self, cosine: Doubles) -> Doubles:
        """Return T, (n, 1)."""
        return self._layers.left(cosine)[:, None]
