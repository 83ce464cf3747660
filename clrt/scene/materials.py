"""Materials: plain data, one dataclass each. A material's behaviour is `kernels/bsdf/<kernel>.cl`.

To add one: write its kernel file, write its dataclass here and list it in MATERIALS. The scene file, the validation,
the packing and the tests of every BSDF find it in that list. Field types carry their limits (annotated-types), which
`validate` checks for scenes from files and from Python alike.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from math import log, log1p
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Self, get_args

from annotated_types import Ge, Gt, Le

from .microfacets import fitted_loss, multiple_scattering
from .presets import CONDUCTORS, F0_PRESETS as F0_PRESETS, ConductorPreset, Preset
from .textures import NonNegative, Texture

Unit = Annotated[float, Ge(0), Le(1)]
Albedo = tuple[Unit, Unit, Unit]
Index = Annotated[float, Ge(0.01), Le(100)]
Extinction = Annotated[float, Ge(0), Le(100)]
Radiance = tuple[NonNegative, NonNegative, NonNegative]
Parameter = float | tuple[float, ...] | Texture

Smith = Literal["height_correlated", "separable", "schlick", "schlick_ibl"]

#: GGX below this alpha is beyond float32 (D ~ 1/(pi alpha²)), in the kernel too; use `Mirror` for a perfect one.
ALPHA_MIN = 1e-4
#: What counts as black where a logarithm is taken.
BLACK = 1e-30


def tuples_for_lists(record: Any) -> None:
    """Makes tuples of a dataclass's lists and arrays of numbers, so that it can be written either way and hashed."""
    for field in fields(record):
        value = getattr(record, field.name)
        if hasattr(value, "tolist"):
            value = value.tolist()
        if isinstance(value, list):
            object.__setattr__(record, field.name, tuple(value))


@dataclass(frozen=True, kw_only=True)
class Material:
    """What every material has.

    emission: radiance in W·sr⁻¹·m⁻² that its front side sends out. normal_map: bends the shading normal (glTF's
    convention: linear, x to the right and y up in the picture); its factor scales how far. opacity: what part of light
    it stops; the rest goes straight through. With an alpha_cutoff it stops all where the opacity reaches that, and
    nothing elsewhere. one_sided: from behind it is not there.
    """

    kernel: ClassVar[str]
    #: Those of its features that have a kernel file of their own, bsdf/<name>.cl: `#include <NAME>_FILE`.
    parts: ClassVar[tuple[str, ...]] = ()
    emission: Radiance | Texture = (0.0, 0.0, 0.0)
    normal_map: Texture | None = None
    opacity: Unit | Texture = 1.0
    alpha_cutoff: Unit | None = None
    one_sided: bool = False

    def __post_init__(self) -> None:
        tuples_for_lists(self)

    def parameters(self) -> dict[str, Parameter]:
        """The values its kernel reads: numbers, triples, rows of a multiple of four, or a texture for a field of these.

        What only some materials of a type have is 0 for the others.
        """
        return {field.name: getattr(self, field.name) for field in fields(self) if field.name not in SHARED}

    def surface_parameters(self) -> dict[str, Parameter]:
        """Those of the fields above that the surface reads, as far as they say anything."""
        parameters: dict[str, Parameter] = {}
        if self.normal_map is not None:
            parameters["normal_map"] = self.normal_map
        if self.opacity != 1 or self.one_sided:
            cutoff = -1.0 if self.alpha_cutoff is None else self.alpha_cutoff
            parameters |= {"opacity": self.opacity, "alpha_cutoff": cutoff, "one_sided": float(self.one_sided)}
        return parameters

    @property
    def radiance(self) -> Radiance:
        """What it sends out, at most where that is a texture."""
        return as_color(self.emission.factor) if isinstance(self.emission, Texture) else self.emission

    def conflicts(self) -> list[str]:
        """What is wrong with its fields together: "FIELD: fault; remedy"."""
        return []

    def without_textures(self: Self) -> Self:
        """Itself with the factors of its textures alone."""
        colors = {field.name for field in fields(self) if isinstance(field.default, tuple)}
        plain: dict[str, Any] = {name: as_color(value.factor) if name in colors else value.factor
                                 for name, value in vars(self).items() if isinstance(value, Texture)}
        return replace(self, **plain | {"normal_map": None})

    def textures(self) -> list[Texture]:
        """All that it reads."""
        values = (getattr(self, field.name) for field in fields(self))
        return [value for value in values if isinstance(value, Texture)]

    @property
    def is_specular(self) -> bool:
        """Whether it has single directions alone, which no light sample finds."""
        return False

    def in_unit(self, unit: float) -> Material:
        """The same where all lengths are multiplied by `unit`."""
        return self

    def features(self) -> frozenset[str]:
        """Names to define while compiling, for parts of the kernel that only some materials of this type need."""
        return frozenset()


#: The fields that do not belong to a material's own kernel file.
SHARED = frozenset(field.name for field in fields(Material))


def as_color(factor: float | Radiance) -> Radiance:
    """One number for all channels, or three."""
    return factor if isinstance(factor, tuple) else (factor, factor, factor)


@dataclass(frozen=True, kw_only=True)
class Diffuse(Material):
    """Lambert: f = color/π."""

    kernel: ClassVar[str] = "diffuse"
    color: Albedo | Texture = (0.8, 0.8, 0.8)


class Lobes(NamedTuple):
    """f0: specular reflectance at normal incidence; albedo: of the diffuse body, unattenuated; alpha: roughness²."""

    f0: tuple[float, ...]
    albedo: tuple[float, ...]
    alpha: float


@dataclass(frozen=True, kw_only=True)
class MetallicRoughness(Material):
    """Cook–Torrance with GGX over Lambert (glTF's base material; Suchiński 6.5–6.15, Nadolny 3.5–3.13).

    alpha = roughness². `preset` takes F0 (and for metals the color) from the table. `smith` chooses the
    shadowing–masking term: height-correlated (glTF), separable G1·G1, or Schlick-GGX with k = (r+1)²/8 ("schlick")
    or k = r²/2 ("schlick_ibl"). `multiple_scattering` gives back what one bounce between microfacets leaves out
    (scene.microfacets): white metal then reflects all light, and coloured metal grows deeper in color.
    """

    kernel: ClassVar[str] = "metallic_roughness"
    color: Albedo | Texture = (0.8, 0.8, 0.8)
    metallic: Unit | Texture = 0.0
    roughness: Unit | Texture = 0.5
    preset: Preset | None = None
    smith: Smith = "height_correlated"
    multiple_scattering: bool = False

    def parameters(self) -> dict[str, Parameter]:
        color, specular, metallic = self.color, (0.04, 0.04, 0.04), self.metallic
        if self.preset is not None:
            specular, metallic = F0_PRESETS[self.preset]
            color = specular if metallic else color
        single: dict[str, Parameter] = {"color": color, "metallic": metallic, "roughness": self.roughness,
                                        "specular": specular, "smith": float(get_args(Smith).index(self.smith))}
        if not self.multiple_scattering:
            return single
        f0, alpha = self.lobes.f0, self.lobes.alpha
        loss = fitted_loss(alpha, self.smith)
        return {**single, "multiple": multiple_scattering(f0, loss.mean), "mean_loss": loss.mean, "width": loss.width,
                "spread": log1p(alpha**-2), "loss": loss.coefficients}

    def conflicts(self) -> list[str]:
        painted = any(isinstance(value, Texture) for value in (self.color, self.metallic, self.roughness))
        fault = "multiple_scattering: is not known for textures; leave it out, or write numbers for color and the like"
        return [fault] if self.multiple_scattering and painted else []

    @property
    def lobes(self) -> Lobes:
        """What its parameters come to; TypeError if one of them is a texture."""
        single = replace(self, multiple_scattering=False).parameters()
        color, specular, metallic, roughness = (single[name] for name in ("color", "specular", "metallic", "roughness"))
        if not (isinstance(color, tuple) and isinstance(specular, tuple) and isinstance(metallic, float | int)
                and isinstance(roughness, float | int)):
            raise TypeError("a texture has no lobes of its own")
        f0 = tuple(s + metallic * (c - s) for s, c in zip(specular, color))
        return Lobes(f0, tuple((1 - metallic) * c for c in color), max(roughness**2, ALPHA_MIN))

    def features(self) -> frozenset[str]:
        multiple = {"MULTIPLE_SCATTERING"} if self.multiple_scattering else set()
        return frozenset({f"SMITH_{self.smith.upper()}"} | multiple)


@dataclass(frozen=True, kw_only=True)
class Conductor(Material):
    """A metal by its measured complex index of refraction eta + i·k in each channel, with GGX's microfacets.

    `preset` takes both from a table (scene.presets), unless they are given. alpha = roughness². One bounce between
    microfacets counts.
    """

    kernel: ClassVar[str] = "conductor"
    preset: ConductorPreset = "gold"
    eta: tuple[Index, Index, Index] | None = None
    k: tuple[Extinction, Extinction, Extinction] | None = None
    roughness: Unit | Texture = 0.3

    def parameters(self) -> dict[str, Parameter]:
        eta, k = CONDUCTORS[self.preset]
        return {"eta": self.eta or eta, "k": self.k or k, "roughness": self.roughness}

    def conflicts(self) -> list[str]:
        alone = (self.eta is None) != (self.k is None)
        return ["eta: and k belong together; write both, or a preset alone"] if alone else []


@dataclass(frozen=True, kw_only=True)
class Mirror(Material):
    """A perfect mirror that reflects `color` of the light at every angle."""

    kernel: ClassVar[str] = "mirror"
    color: Albedo | Texture = (1.0, 1.0, 1.0)

    @property
    def is_specular(self) -> bool:
        return True


@dataclass(frozen=True, kw_only=True)
class Dielectric(Material):
    """Glass or water: Fresnel's equations decide between reflection and refraction.

    ior: index of refraction inside over that outside; color: what part of the light that is refracted passes.
    roughness: of the surface, alpha = roughness² of GGX's microfacets; 0 is smooth. thin: a sheet without an inside,
    which bends nothing and passes `color` from face to face. Inside of others light becomes attenuation_color after the
    attenuation_distance, in units of the scene, and so on (glTF's KHR_materials_volume; None: never).
    """

    kernel: ClassVar[str] = "dielectric"
    parts: ClassVar[tuple[str, ...]] = ("ROUGH_DIELECTRIC",)
    color: Albedo | Texture = (1.0, 1.0, 1.0)
    ior: Annotated[float, Ge(0.25), Le(4)] = 1.5
    roughness: Unit | Texture = 0.0
    thin: bool = False
    attenuation_color: Albedo = (1.0, 1.0, 1.0)
    attenuation_distance: Annotated[float, Gt(0)] | None = None

    def parameters(self) -> dict[str, Parameter]:
        values: dict[str, Parameter] = {"color": self.color, "ior": self.ior}
        if self.rough:
            values["roughness"] = self.roughness
        if self.thin:
            values["thin"] = 1.0
        if (distance := self.attenuation_distance) is not None:
            values["absorption"] = tuple(min(-log(max(part, BLACK)) / distance, 1 / BLACK)
                                         for part in self.attenuation_color)
        return values

    @property
    def rough(self) -> bool:
        """Whether some of it is."""
        return isinstance(self.roughness, Texture) or self.roughness > 0

    @property
    def is_specular(self) -> bool:
        return not self.rough or (self.ior == 1 and not self.thin)

    def conflicts(self) -> list[str]:
        fault = "attenuation_distance: a thin sheet has no inside; leave it out, or thin"
        return [fault] if self.thin and self.attenuation_distance is not None else []

    def in_unit(self, unit: float) -> Dielectric:
        distance = self.attenuation_distance
        return self if distance is None else replace(self, attenuation_distance=distance * unit)

    def features(self) -> frozenset[str]:
        has = {"TRANSMISSION": True, "ROUGH_DIELECTRIC": self.rough, "TRANSMISSION_LOBES": self.rough,
               "THIN_DIELECTRIC": self.thin, "ATTENUATION": self.attenuation_distance is not None}
        return frozenset(name for name, present in has.items() if present)


@dataclass(frozen=True, kw_only=True)
class Phong(Material):
    """Phong's model: Lambert and a gloss around the mirrored direction (Nadolny 3.1–3.3).

    specular: of the gloss, the more narrow the larger `shininess` is. ambient: what part of `color` the local
    integrator gives to the sky's light. In the path integrators the body has at most what the gloss leaves,
    1 − specular, and the gloss reflects `specular` of light from straight above (Lafortune and Willems 1994).
    """

    kernel: ClassVar[str] = "phong"
    color: Albedo | Texture = (0.8, 0.8, 0.8)
    specular: Albedo | Texture = (0.2, 0.2, 0.2)
    shininess: Annotated[float, Ge(0), Le(10000)] = 32.0
    ambient: Unit = 1.0


@dataclass(frozen=True, kw_only=True)
class BlinnPhong(Phong):
    """Blinn's model: Phong's by the half vector, about as wide with four times its shininess."""

    kernel: ClassVar[str] = "blinn_phong"


MATERIALS: tuple[type[Material], ...] = (Diffuse, MetallicRoughness, Mirror, Dielectric, Conductor, Phong,
                                         BlinnPhong)
