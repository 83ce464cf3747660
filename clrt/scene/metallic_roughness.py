"""glTF's base material."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import log1p
from typing import ClassVar, Literal, NamedTuple, get_args

from .material import ALPHA_MIN, Albedo, Material, Parameter, Unit
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
