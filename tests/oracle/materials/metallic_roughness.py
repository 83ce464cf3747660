"""glTF 2.0's metallic-roughness material (its specification, appendix B), with KHR_materials_ior and _specular, and
with the body below a surface that light crosses twice.

    f = F(wi·h)·D·G/(4·cos·cos) + (1 − F(cos wi))(1 − F(cos wo))·body/π,  body = (1 − metallic)·color

F is Schlick's, between F0 (of a dielectric and of `color`, mixed by `metallic`) and F90.
"""

from __future__ import annotations

import numpy as np

from clrt.scene.metallic_roughness import MetallicRoughness
from clrt.scene.presets import F0_PRESETS

from ..surface import Surface
from ..vectors import Doubles, dot
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
        self.strategies = [VisibleNormals(self.alpha), Cosine()]

    def evaluate(self, wo: Doubles, wi: Doubles) -> Doubles:
        crossed = (1 - self._fresnel(wo[:, 2])) * (1 - self._fresnel(np.maximum(wi[:, 2], 0)))
        under = crossed * self.body * np.maximum(wi[:, 2:], 0) / np.pi
        gloss = self._fresnel(np.abs(dot(wo, halfway(wo, wi))))
        return np.asarray(under + gloss * reflection(wo, wi, self.alpha, self.smith)[:, None])

    def _fresnel(self, cosine: Doubles) -> Doubles:
        return schlick(cosine, self.f0, self.f90)
