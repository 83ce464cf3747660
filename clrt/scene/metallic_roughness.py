"""glTF's base material."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import log1p
from typing import Annotated, ClassVar, Literal, NamedTuple, get_args

from .limits import Ge, Le
from .material import ALPHA_MIN, Albedo, Material, Parameter, Radiance, Unit
from .microfacets import fitted_loss, multiple_scattering
from .presets import F0_PRESETS, Preset
from .textures import Texture

Smith = Literal["height_correlated", "separable", "schlick", "schlick_ibl"]


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

    The rest are glTF's extensions by their names. `ior`, `specular` and `specular_color`: F0 of what is no metal,
    ((ior − 1)/(ior + 1))²·specular·specular_color, and F at grazing angles, `specular`. `clearcoat`: a clear film,
    bent by `clearcoat_normal_map` alone. `sheen_color`: fibres. `transmission`: the part of what is no metal that is a
    sheet which light passes.
    """

    kernel: ClassVar[str] = "metallic_roughness"
    parts: ClassVar[tuple[str, ...]] = ("LAYERS", "SHEEN")
    color: Albedo | Texture = (0.8, 0.8, 0.8)
    metallic: Unit | Texture = 0.0
    roughness: Unit | Texture = 0.5
    preset: Preset | None = None
    smith: Smith = "height_correlated"
    multiple_scattering: bool = False
    ior: Annotated[float, Ge(1), Le(4)] = 1.5
    specular: Unit | Texture = 1.0
    specular_color: Radiance | Texture = (1.0, 1.0, 1.0)
    clearcoat: Unit | Texture = 0.0
    clearcoat_roughness: Unit | Texture = 0.0
    clearcoat_normal_map: Texture | None = None
    sheen_color: Albedo | Texture = (0.0, 0.0, 0.0)
    sheen_roughness: Unit | Texture = 0.0
    transmission: Unit | Texture = 0.0

    def parameters(self) -> dict[str, Parameter]:
        color, f0, metallic = self.color, (((self.ior - 1) / (self.ior + 1))**2,) * 3, self.metallic
        if self.preset is not None:
            f0, metallic = F0_PRESETS[self.preset]
            color = f0 if metallic else color
        single: dict[str, Parameter] = {"color": color, "metallic": metallic, "roughness": self.roughness,
                                        "f0": f0, "smith": float(get_args(Smith).index(self.smith))}
        single |= self._layers()
        if not self.multiple_scattering:
            return single
        lobes = self.lobes
        loss = fitted_loss(lobes.alpha, self.smith)
        return {**single, "multiple": multiple_scattering(lobes.f0, loss.mean), "mean_loss": loss.mean,
                "width": loss.width, "spread": log1p(lobes.alpha**-2), "loss": loss.coefficients}

    def _layers(self) -> dict[str, Parameter]:
        """What its kernel reads of the extensions in use."""
        has, values = self.features(), dict[str, Parameter]()
        if "SPECULAR" in has:
            values |= {"specular": self.specular, "specular_color": self.specular_color}
        if "CLEARCOAT" in has:
            values |= {"clearcoat": self.clearcoat, "clearcoat_roughness": self.clearcoat_roughness}
            values |= {} if self.clearcoat_normal_map is None else {"clearcoat_normal_map": self.clearcoat_normal_map}
        if "SHEEN" in has:
            values |= {"sheen_color": self.sheen_color, "sheen_roughness": self.sheen_roughness}
        return values | ({"transmission": self.transmission} if "THROUGH" in has else {})

    @property
    def bent_by(self) -> Texture | None:
        return self.normal_map or (self.clearcoat_normal_map if self.clearcoat != 0 else None)

    def conflicts(self) -> list[str]:
        painted = any(isinstance(value, Texture) for value in (self.color, self.metallic, self.roughness))
        if not self.multiple_scattering or not (painted or "SPECULAR" in self.features()):
            return []
        remedy = "leave it out, or specular" if not painted else "leave it out, or write numbers for color and the like"
        return [f"multiple_scattering: is not known for {'textures' if painted else 'specular'}; {remedy}"]

    @property
    def lobes(self) -> Lobes:
        """What its parameters come to; TypeError if one of them is a texture."""
        single = replace(self, multiple_scattering=False).parameters()
        color, f0, metallic, roughness = (single[name] for name in ("color", "f0", "metallic", "roughness"))
        if not (isinstance(color, tuple) and isinstance(f0, tuple) and isinstance(metallic, float | int)
                and isinstance(roughness, float | int)):
            raise TypeError("a texture has no lobes of its own")
        f0 = tuple(f + metallic * (c - f) for f, c in zip(f0, color))
        return Lobes(f0, tuple((1 - metallic) * c for c in color), max(roughness**2, ALPHA_MIN))

    def features(self) -> frozenset[str]:
        layers = {"CLEARCOAT": self.clearcoat != 0, "SHEEN": self.sheen_color != (0, 0, 0),
                  "THROUGH": self.transmission != 0}
        has = {f"SMITH_{self.smith.upper()}": True, "MULTIPLE_SCATTERING": self.multiple_scattering, **layers,
               "COAT_NORMALS": layers["CLEARCOAT"] and self.bent_by is not None,
               "LAYERS": any(layers.values()), "SPECULAR": self.specular != 1 or self.specular_color != (1, 1, 1),
               "TRANSMISSION": layers["THROUGH"], "TRANSMISSION_LOBES": layers["THROUGH"]}
        return frozenset(name for name, present in has.items() if present)
