"""Parameters of metallic_roughness at hits, with KHR_materials_ior, _specular, and both transmissions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clrt.scene.materials.metallic_roughness import MetallicRoughness
from clrt.scene.materials.presets import F0_PRESETS

from ..surface import Surface
from ..vectors import Doubles
from .fresnel import schlick
from .ggx import alpha_of


@dataclass(frozen=True)
class Fresnel:
    """Schlick's F between f0 (n, 3) and f90 (n, 1)."""

    f0: Doubles
    f90: Doubles

    def at(self, cosine: Doubles) -> Doubles:
        """Return F (n, 3) at cosines (n,)."""
        return schlick(cosine, self.f0, self.f90)

    def reflected(self, bounce: tuple[Doubles, Doubles]) -> Doubles:
        """Return a bounce's reflection (n, 3), given (n, 1) by f0 and f90."""
        return np.asarray(self.f0 * bounce[0] + self.f90 * bounce[1])

    def passed(self, bounce: tuple[Doubles, Doubles]) -> Doubles:
        """Return the same with 1 − F, (n, 3)."""
        return np.asarray((1 - self.f0) * bounce[0] + (1 - self.f90) * bounce[1])


class Substance:
    """dielectric, gloss: F of the dielectric part, and mixed with the metal; body, passing, leaf: (n, 3) color of light
    that enters and is reflected diffusely, transmitted by microfacets, or diffusely; color (n, 3); metallic (n, 1)."""

    def __init__(self, material: MetallicRoughness, at: Surface) -> None:
        self.alpha, self.smith = alpha_of(at.number(material.roughness)), material.smith
        base: Doubles = np.array(((material.ior - 1) / (material.ior + 1)) ** 2)
        self.color, self.metallic = at.tinted(material.color), at.number(material.metallic)[:, None]
        if material.preset is not None:
            f0, is_metal = F0_PRESETS[material.preset]
            base, self.metallic = np.array(f0), np.full_like(self.metallic, is_metal)
            self.color = at.tinted(f0) if is_metal else self.color
        specular = at.number(material.specular)[:, None]
        plastic = np.minimum(base * at.color(material.specular_color), 1) * specular
        self.dielectric = Fresnel(plastic, specular)
        self.gloss = Fresnel(
            plastic + self.metallic * (self.color - plastic), specular + self.metallic * (1 - specular)
        )
        through = at.number(material.transmission)[:, None]
        body, self.passing = ((1 - self.metallic) * self.color * part for part in (1 - through, through))
        scattered = at.number(material.diffuse_transmission)[:, None]
        tint = at.color(material.diffuse_transmission_color)
        self.leaf = (1 - self.metallic) * (1 - through) * scattered * tint
        self.body = body * (1 - scattered)
