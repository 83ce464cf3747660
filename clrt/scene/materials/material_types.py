"""Materials: plain data, one dataclass each. A material's BSDF is `kernels/bsdf/<kernel>.cl`.

To add one: write its kernel file, write its dataclass here and list it in MATERIALS, where the scene file, the
validation, the packing and the tests of every BSDF find it. Field types carry their limits (limits.py), which are
checked when a material is made, from a file or in Python. MetallicRoughness, Plastic and Principled have
files of their own.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import log
from typing import Annotated, ClassVar, Literal

from ..fields.limits import Ge, Gt, Le
from .dielectric_energy import ROWS, tables
from .material import MOST_IOR, Albedo as Albedo, Material as Material, Parameter, Unit
from .metallic_roughness import ALONG_U, MetallicRoughness as MetallicRoughness
from .plastic import Distribution, Plastic as Plastic
from .presets import CONDUCTORS, ConductorPreset
from .principled import Principled as Principled
from .textures import NonNegative, Texture

Index = Annotated[float, Ge(0.01), Le(100)]
Extinction = Annotated[float, Ge(0), Le(100)]

#: Lower limit of colors when taking their logarithm.
BLACK = 1e-30
WHITE = (1.0, 1.0, 1.0)
SmithTerm = Literal["height_correlated", "separable"]


@dataclass(frozen=True, kw_only=True)
class Diffuse(Material):
    """Lambertian reflection: f = color/π."""

    kernel: ClassVar[str] = "diffuse"
    color: Albedo | Texture = (0.8, 0.8, 0.8)


@dataclass(frozen=True, kw_only=True)
class Conductor(Material):
    """Metal with a measured complex index of refraction eta + i·k per channel and a microfacet distribution.

    `preset` takes both from a table (scene.presets), unless they are given. alpha = roughness². `reflectance`, which
    measured metals do not have, multiplies what is reflected. `smith`: the masking–shadowing term. `roughness_across`:
    that across the tangent, the direction of u on the surface; `roughness` is then along it. Single scattering only.
    """

    kernel: ClassVar[str] = "conductor"
    parts: ClassVar[tuple[str, ...]] = ("BECKMANN", "BRUSH")
    preset: ConductorPreset = "gold"
    eta: tuple[Index, Index, Index] | None = None
    k: tuple[Extinction, Extinction, Extinction] | None = None
    roughness: Unit | Texture = 0.3
    reflectance: Albedo | Texture = (1.0, 1.0, 1.0)
    roughness_across: Unit | Texture | None = None
    distribution: Distribution = "ggx"
    smith: SmithTerm = "height_correlated"

    def parameters(self) -> dict[str, Parameter]:
        eta, k = CONDUCTORS[self.preset]
        values: dict[str, Parameter] = {"eta": self.eta or eta, "k": self.k or k, "roughness": self.roughness}
        has = self.features()
        values |= {"reflectance": self.reflectance} if "TINTED_CONDUCTOR" in has else {}
        values |= {"beckmann": 1.0} if "BECKMANN_CONDUCTOR" in has else {}
        values |= {"separable": 1.0} if "SEPARABLE_CONDUCTOR" in has else {}
        if self.roughness_across is not None:
            values |= {"roughness_across": self.roughness_across, "anisotropic": 1.0}
        return values

    @property
    def bent_by(self) -> Texture | None:
        return self.normal_map or (None if self.roughness_across is None else ALONG_U)

    def features(self) -> frozenset[str]:
        has = {"TINTED_CONDUCTOR": self.reflectance != WHITE, "SEPARABLE_CONDUCTOR": self.smith == "separable"}
        has |= dict.fromkeys(("BRUSH", "ANISOTROPIC_CONDUCTOR"), self.roughness_across is not None)
        has |= dict.fromkeys(("BECKMANN", "BECKMANN_CONDUCTOR"), self.distribution == "beckmann")
        return frozenset(name for name, present in has.items() if present)

    def conflicts(self) -> list[str]:
        faults = super().conflicts()
        if (self.eta is None) != (self.k is None):
            given, other = ("k", "eta") if self.eta is None else ("eta", "k")
            faults.append(f"{given}: is given without {other}; write both, or a preset alone")
        return faults


@dataclass(frozen=True, kw_only=True)
class Mirror(Material):
    """Perfect mirror that reflects the fraction `color` at every angle."""

    kernel: ClassVar[str] = "mirror"
    color: Albedo | Texture = (1.0, 1.0, 1.0)

    @property
    def is_specular(self) -> bool:
        return True


@dataclass(frozen=True, kw_only=True)
class Dielectric(Material):
    """Glass or water: the Fresnel equations give the fractions reflected and refracted.

    - ior: index of refraction inside over that outside
    - color: the fraction of the refracted light that is transmitted
    - reflectance: multiplies the reflected light, which real glass does not
    - roughness: of the surface, with alpha = roughness² of the microfacets' distribution; 0 is smooth
    - distribution, smith: of the microfacets of rough glass; others than the default ones scatter once only
    - multiple_scattering: compensates the energy that single scattering between microfacets loses, so that rough glass
      loses no light
    - dispersion: 20 over the Abbe number of smooth glass: red, green and blue have indices of refraction of their own
      (glTF's KHR_materials_dispersion); `ior` is that of green
    - thin: a sheet without an interior, which does not bend light and transmits `color` from face to face
    - attenuation_color, attenuation_distance: inside others light is attenuated to this color per this distance, in
      scene units (glTF's KHR_materials_volume; None: no attenuation)
    """

    kernel: ClassVar[str] = "dielectric"
    parts: ClassVar[tuple[str, ...]] = ("ROUGH_DIELECTRIC", "DIELECTRIC_ENERGY", "DISPERSION", "BECKMANN")
    color: Albedo | Texture = (1.0, 1.0, 1.0)
    ior: Annotated[float, Ge(1 / MOST_IOR), Le(MOST_IOR)] = 1.5
    roughness: Unit | Texture = 0.0
    reflectance: Albedo | Texture = WHITE
    distribution: Distribution = "ggx"
    smith: SmithTerm = "height_correlated"
    multiple_scattering: bool = True
    thin: bool = False
    dispersion: NonNegative = 0.0
    attenuation_color: Albedo = (1.0, 1.0, 1.0)
    attenuation_distance: Annotated[float, Gt(0)] | None = None

    def parameters(self) -> dict[str, Parameter]:
        values: dict[str, Parameter] = {"color": self.color, "ior": self.ior}
        if self.rough:
            values["roughness"] = self.roughness
        if self.scatters_again:
            one = None if isinstance(self.roughness, Texture) else self.roughness
            values |= {"energy": tables(self.ior, one, self.thin), "last_row": ROWS - 1.0 if one is None else 0.0}
        if self.thin:
            values["thin"] = 1.0
        if self.dispersion:
            values["dispersion"] = self.dispersion
        has = self.features()
        values |= {"reflectance": self.reflectance} if "TINTED_DIELECTRIC" in has else {}
        values |= {name: 1.0 for name in ("beckmann", "separable") if f"{name.upper()}_DIELECTRIC" in has}
        if (distance := self.attenuation_distance) is not None:
            values["absorption"] = tuple(
                min(-log(max(part, BLACK)) / distance, 1 / BLACK) for part in self.attenuation_color
            )
        return values

    @property
    def rough(self) -> bool:
        """Whether the surface, or some of it, is rough."""
        return isinstance(self.roughness, Texture) or self.roughness > 0

    @property
    def scatters_again(self) -> bool:
        """Whether multiple scattering between microfacets is compensated."""
        return self.multiple_scattering and not self.is_specular

    @property
    def is_specular(self) -> bool:
        return not self.rough or (self.ior == 1 and not self.thin)

    def conflicts(self) -> list[str]:
        fault = "attenuation_distance: a thin surface has no interior; leave it out, or remove thin"
        faults = super().conflicts() + [fault] * (self.thin and self.attenuation_distance is not None)
        if self.dispersion and (self.rough or self.thin):
            faults.append("dispersion: is for solid glass with roughness = 0; write dispersion = 0")
        if self.dispersion and self.reflectance != WHITE:
            faults.append("dispersion: is for glass with reflectance = [1, 1, 1]; write dispersion = 0")
        single = {"reflectance": WHITE, "distribution": "ggx", "smith": "height_correlated"}
        if self.scatters_again:
            faults += [
                f"{name}: scatters once only; write multiple_scattering = false, or leave {name} out"
                for name, usual in single.items()
                if getattr(self, name) != usual
            ]
        return faults

    def in_unit(self, unit: float) -> Dielectric:
        distance = self.attenuation_distance
        return self if distance is None else replace(self, attenuation_distance=distance * unit)

    def features(self) -> frozenset[str]:
        has = {
            "TRANSMISSION": True,
            "ROUGH_DIELECTRIC": self.rough,
            "TRANSMISSION_LOBES": self.rough,
            "DIELECTRIC_ENERGY": self.scatters_again,
            "THIN_DIELECTRIC": self.thin,
            "ATTENUATION": self.attenuation_distance is not None,
            "DISPERSION": self.dispersion != 0,
            "TINTED_DIELECTRIC": self.reflectance != WHITE,
            "BECKMANN": self.rough and self.distribution == "beckmann",
            "BECKMANN_DIELECTRIC": self.rough and self.distribution == "beckmann",
            "SEPARABLE_DIELECTRIC": self.rough and self.smith == "separable",
        }
        return frozenset(name for name, present in has.items() if present)


@dataclass(frozen=True, kw_only=True)
class Phong(Material):
    """Phong's model: a Lambertian lobe and a specular lobe around the mirror direction (Nadolny 3.1–3.3).

    specular: color of the specular lobe, which is narrower the larger `shininess` is. ambient: the fraction of `color`
    that the local integrator multiplies with the sky's light. In the path integrators the Lambertian lobe is limited to
    1 − specular, and the specular lobe reflects `specular` at normal incidence (Lafortune and Willems 1994).
    """

    kernel: ClassVar[str] = "phong"
    color: Albedo | Texture = (0.8, 0.8, 0.8)
    specular: Albedo | Texture = (0.2, 0.2, 0.2)
    shininess: Annotated[float, Ge(0), Le(10000)] = 32.0
    ambient: Unit = 1.0


@dataclass(frozen=True, kw_only=True)
class BlinnPhong(Phong):
    """Blinn's model: Phong's with the half vector; about as wide at four times the shininess."""

    kernel: ClassVar[str] = "blinn_phong"


MATERIALS: tuple[type[Material], ...] = (
    Diffuse,
    MetallicRoughness,
    Mirror,
    Dielectric,
    Conductor,
    Phong,
    BlinnPhong,
    Plastic,
    Principled,
)
