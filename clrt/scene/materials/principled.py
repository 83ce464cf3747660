"""Disney's principled BSDF, as Mitsuba's `principled` defines it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from ..fields.limits import Ge, Le
from .material import MOST_IOR, Albedo, Material, Parameter, Unit
from .metallic_roughness import ALONG_U
from .textures import Texture

#: Parameters that are compiled only for materials where they are not 0, by the features that need them.
PARTS = {
    "PRINCIPLED_TRANSMISSION": ("spec_trans",),
    "PRINCIPLED_TINT": ("spec_tint",),
    "PRINCIPLED_SHEEN": ("sheen", "sheen_tint"),
    "PRINCIPLED_FLATNESS": ("flatness",),
    "PRINCIPLED_CLEARCOAT": ("clearcoat", "clearcoat_gloss"),
    "PRINCIPLED_ANISOTROPY": ("anisotropic",),
}


@dataclass(frozen=True, kw_only=True)
class Principled(Material):
    """Disney's principled BSDF (Burley 2012, 2015): diffuse, sheen, specular and clearcoat lobes, and transmission.

    - color, metallic, roughness: as in `MetallicRoughness`; alpha = roughness², at least 0.001
    - ior: index of refraction inside over that outside; Disney's `specular` is ((ior − 1)/(ior + 1))²/0.08
    - spec_tint: how far the dielectric's specular reflection is tinted by `color`
    - spec_trans: the fraction of the dielectric part that refracts light, tinted by √color, instead of scattering it
    - anisotropic: alpha is divided along the tangent, the direction of u, and multiplied across it by √(1 − 0.9·this)
    - sheen, sheen_tint: strength of the lobe of fibers, and how far it is tinted
    - flatness: how far the diffuse lobe is replaced by one as flat as that of subsurface scattering
    - clearcoat, clearcoat_gloss: strength of a coat of index 1.5, and its alpha, from 0.1 at 0 to 0.001 at 1

    Lobes are added up without regard to the light that is left to them: white surfaces gain energy.
    """

    kernel: ClassVar[str] = "principled"
    parts: ClassVar[tuple[str, ...]] = ("BRUSH",)
    color: Albedo | Texture = (0.5, 0.5, 0.5)
    metallic: Unit | Texture = 0.0
    roughness: Unit | Texture = 0.5
    ior: Annotated[float, Ge(1 / MOST_IOR), Le(MOST_IOR)] = 1.5
    spec_tint: Unit | Texture = 0.0
    spec_trans: Unit | Texture = 0.0
    anisotropic: Unit | Texture = 0.0
    sheen: Unit | Texture = 0.0
    sheen_tint: Unit | Texture = 0.0
    flatness: Unit | Texture = 0.0
    clearcoat: Unit | Texture = 0.0
    clearcoat_gloss: Unit | Texture = 0.0

    def parameters(self) -> dict[str, Parameter]:
        has = self.features()
        names = ["color", "metallic", "roughness", "ior"]
        names += [name for part, used in PARTS.items() if part in has for name in used]
        transmits = {"transmits": 1.0} if "TRANSMISSION" in has else {}
        return {name: getattr(self, name) for name in names} | transmits

    @property
    def bent_by(self) -> Texture | None:
        return self.normal_map or (ALONG_U if "BRUSH" in self.features() else None)

    def features(self) -> frozenset[str]:
        has = {part for part, (strength, *_) in PARTS.items() if getattr(self, strength) != 0}
        has |= {"BRUSH"} if "PRINCIPLED_ANISOTROPY" in has else set()
        has |= {"TRANSMISSION", "TRANSMISSION_LOBES"} if "PRINCIPLED_TRANSMISSION" in has else set()
        return frozenset(has)
