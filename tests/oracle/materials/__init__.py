"""The materials that the oracle supports, one file each."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from clrt.scene.materials.material import Material
from clrt.scene.materials.material_types import (
    BlinnPhong,
    Conductor,
    Dielectric,
    Diffuse,
    MetallicRoughness,
    Mirror,
    Phong,
    Plastic,
    Principled,
)

from ..surface import Surface
from .conductor import Metal
from .diffuse import Lambertian
from .dispersion import glass
from .metallic_roughness import CookTorrance
from .mirror import Specular
from .phong import BlinnGloss, PhongGloss
from .plastic import CoatedBase
from .principled import Lobes
from .scattering import Scattering

SCATTERINGS: dict[type[Material], Callable[[Any, Surface], Scattering]] = {
    Diffuse: Lambertian,
    MetallicRoughness: CookTorrance,
    Mirror: Specular,
    Dielectric: glass,
    Conductor: Metal,
    Phong: PhongGloss,
    BlinnPhong: BlinnGloss,
    Plastic: CoatedBase,
    Principled: Lobes,
}


def scattering_of(material: Material, at: Surface) -> Scattering:
    """Return the scattering of a material at hits."""
    return SCATTERINGS[type(material)](material, at)
