"""glTF 2.0's metallic-roughness material (its specification, appendix B), with KHR_materials_ior and _specular.

    f = F(wi·h)·D·G/(4·cos·cos) + coupling·body/π,  body = (1 − metallic)·color

F is Schlick's, between F0 (of a dielectric and of `color`, mixed by `metallic`) and F90. The coupling is 1 − F(wi·h)
(glTF), (1 − F(cos wi))(1 − F(cos wo)), or that of Kelemen and Szirmay-Kalos 2001, "A Microfacet Based Coupled
Specular-Matte BRDF Model", (1 − E(wi))(1 − E(wo))/(1 − mean E) with the directional albedo E of the dielectric's gloss.
That one has further bounces between microfacets of the metal (Kulla and Conty 2017, "Revisiting Physically Based
Shading at Imageworks") in the same lobe, r(wi)·r(wo)/(π·mean r), r = body·(1 − E) + metallic·multiple·lost.
"""

from __future__ import annotations

import numpy as np

from clrt.scene.metallic_roughness import MetallicRoughness
from clrt.scene.presets import F0_PRESETS

from ..surface import Surface
from ..vectors import Doubles, dot
from .albedo import Albedos
from .fresnel import schlick
from .ggx import VisibleNormals, alpha_of, reflection
from .scattering import Cosine, Mixed, halfway


class CookTorrance(Mixed):
    def __init__(self, material: MetallicRoughness, at: Surface) -> None:
        self.smith, self.alpha = material.smith, alpha_of(at.number(material.roughness))
        base: Doubles = np.array(((material.ior - 1) / (material.ior + 1))**2)
        color, metallic = at.tinted(material.color), at.number(material.metallic)[:, None]
        if material.preset is not None:
            f0, is_metal = F0_PRESETS[material.preset]
            base, metallic = np.array(f0), np.full_like(metallic, is_metal)
            color = at.tinted(f0) if is_metal else color
        specular = at.number(material.specular)[:, None]
        plastic = np.minimum(base * at.color(material.specular_color), 1) * specular
        self.f0 = plastic + metallic * (color - plastic)
        self.f90 = specular + metallic * (1 - specular)
        self.body = (1 - metallic) * color
        self.diffuse = {"albedo": self._by_albedo, "fresnel": self._by_fresnel,
                        "half_vector": self._by_half_vector}[material.coupled_by]
        self.strategies = [VisibleNormals(self.alpha), Cosine()]
        if material.coupled_by == "albedo":
            self._albedos, self._under = Albedos(self.smith, at.number(material.roughness)), (plastic, specular)
            mean_f, lost = (1 + 20 * color) / 21, 1 - sum(self._albedos.mean())
            self._multiple = metallic * mean_f**2 * (1 - lost) / (1 - mean_f * lost)
            self._multiple = np.zeros_like(color) if material.multiple_scattering is False else self._multiple
        else:
            assert not material.multiple_scattering

    def evaluate(self, wo: Doubles, wi: Doubles) -> Doubles:
        under = self.diffuse(wo, wi) * np.maximum(wi[:, 2:], 0) / np.pi
        gloss = self._fresnel(np.abs(dot(wo, halfway(wo, wi))))
        return np.asarray(under + gloss * reflection(wo, wi, self.alpha, self.smith)[:, None])

    def _by_half_vector(self, wo: Doubles, wi: Doubles) -> Doubles:
        return np.asarray((1 - self._fresnel(np.abs(dot(wo, halfway(wo, wi))))) * self.body)

    def _by_fresnel(self, wo: Doubles, wi: Doubles) -> Doubles:
        return np.asarray((1 - self._fresnel(wo[:, 2])) * (1 - self._fresnel(np.maximum(wi[:, 2], 0))) * self.body)

    def _by_albedo(self, wo: Doubles, wi: Doubles) -> Doubles:
        mean = self._left(self._albedos.mean())
        product = self._left(self._albedos.at(wo[:, 2])) * self._left(self._albedos.at(wi[:, 2]))
        return np.divide(product, mean, out=np.zeros_like(product), where=mean > 0)

    def _left(self, albedos: tuple[Doubles, Doubles]) -> Doubles:
        """r, of one angle or the mean."""
        by_f0, by_f90 = albedos
        f0, f90 = self._under
        return np.asarray(self.body * (1 - f0 * by_f0 - f90 * by_f90) + self._multiple * (1 - by_f0 - by_f90))

    def _fresnel(self, cosine: Doubles) -> Doubles:
        return schlick(cosine, self.f0, self.f90)
