"""glTF's metallic-roughness material."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, radians, sin
from typing import Annotated, ClassVar, Literal, NamedTuple, get_args

from ..fields.limits import Ge, Le
from . import anisotropy_energy, layer_energy
from .material import ALPHA_MIN, MOST_IOR, Albedo, Material, Parameter, Radiance, Unit
from .presets import F0_PRESETS, Preset
from .textures import WHITE, NonNegative, Texture

Smith = Literal["height_correlated", "separable", "schlick", "schlick_ibl"]
Coupling = Literal["albedo", "fresnel", "half_vector"]
#: Fields of the thin film.
FILM = (
    "iridescence",
    "iridescence_ior",
    "iridescence_thickness",
    "iridescence_thickness_minimum",
    "iridescence_thickness_map",
)
#: Stands for a texture where only the tangent along u is needed.
ALONG_U = Texture(picture=WHITE)


class Lobes(NamedTuple):
    """f0: specular reflectance at normal incidence; albedo: of the diffuse lobe, uncoupled; alpha: roughness²."""

    f0: tuple[float, ...]
    albedo: tuple[float, ...]
    alpha: float


@dataclass(frozen=True, kw_only=True)
class MetallicRoughness(Material):
    """Cook–Torrance with GGX over a diffuse lobe (glTF's base material; Suchiński 6.5–6.15, Nadolny 3.5–3.13).

    alpha = roughness². `preset` takes F0 (and for metals the color) from the table. `smith` selects the
    masking–shadowing term: height-correlated (glTF), separable G1·G1, or Schlick-GGX with k = (r+1)²/8 ("schlick")
    or k = r²/2 ("schlick_ibl").

    `coupling` selects how the specular lobe attenuates the diffuse one: "albedo", (1 − E(wi))(1 − E(wo))/(1 − mean E)
    with the directional albedo E of the specular lobe, which conserves energy (Kelemen and Szirmay-Kalos 2001; Kulla
    and Conty 2017); "fresnel", (1 − F(cos wi))(1 − F(cos wo)), which loses some; or "half_vector", 1 − F(wi·h) of the
    theses and glTF, which gains some. `multiple_scattering` compensates what single scattering between microfacets
    loses: white metal then reflects all light, and colored metal becomes more saturated. By default both conserve
    energy with the height-correlated term; with the others they are as in the theses: "fresnel" and single scattering.

    The rest are glTF's extensions, with their names. `ior`, `specular` and `specular_color`: F0 of the dielectric part,
    ((ior − 1)/(ior + 1))²·specular·specular_color, and F at grazing angles, `specular`. `clearcoat`: a clear film,
    affected by `clearcoat_normal_map` alone. `sheen_color`: fibres. `transmission`: the fraction of the dielectric part
    that is a thin transmissive sheet. `anisotropy`: alpha along a direction on the surface is mix(alpha, 1,
    anisotropy²): along the tangent, turned by `anisotropy_degrees` counter-clockwise, or along the directions of
    `anisotropy_map`, red and green from −1 to 1, turned likewise. `iridescence`: the fraction of the surface with a
    thin film of `iridescence_ior`, whose thickness in nanometers is `iridescence_thickness`, or where the map is 0
    `iridescence_thickness_minimum`. `diffuse_transmission`: the fraction of the diffuse lobe that instead transmits
    `diffuse_transmission_color` to the other side.
    """

    kernel: ClassVar[str] = "metallic_roughness"
    parts: ClassVar[tuple[str, ...]] = (
        "LAYERS",
        "LAYER_ENERGY",
        "SHEEN",
        "IRIDESCENCE",
        "ANISOTROPY",
        "ANISOTROPY_ALBEDO",
        "GGX_ALBEDO",
        *(f"ALBEDO_{smith.upper()}" for smith in get_args(Smith)),
    )
    color: Albedo | Texture = (0.8, 0.8, 0.8)
    metallic: Unit | Texture = 0.0
    roughness: Unit | Texture = 0.5
    preset: Preset | None = None
    smith: Smith = "height_correlated"
    coupling: Coupling | None = None
    multiple_scattering: bool | None = None
    ior: Annotated[float, Ge(1), Le(MOST_IOR)] = 1.5
    specular: Unit | Texture = 1.0
    specular_color: Radiance | Texture = (1.0, 1.0, 1.0)
    clearcoat: Unit | Texture = 0.0
    clearcoat_roughness: Unit | Texture = 0.0
    clearcoat_normal_map: Texture | None = None
    sheen_color: Albedo | Texture = (0.0, 0.0, 0.0)
    sheen_roughness: Unit | Texture = 0.0
    transmission: Unit | Texture = 0.0
    anisotropy: Unit | Texture = 0.0
    anisotropy_degrees: float = 0.0
    anisotropy_map: Texture | None = None
    diffuse_transmission: Unit | Texture = 0.0
    diffuse_transmission_color: Albedo | Texture = (1.0, 1.0, 1.0)
    iridescence: Unit | Texture = 0.0
    iridescence_ior: Annotated[float, Ge(1), Le(MOST_IOR)] = 1.3
    iridescence_thickness: NonNegative = 400.0
    iridescence_thickness_minimum: NonNegative = 100.0
    iridescence_thickness_map: Unit | Texture = 1.0

    def parameters(self) -> dict[str, Parameter]:
        color, f0, metallic = self.color, (((self.ior - 1) / (self.ior + 1)) ** 2,) * 3, self.metallic
        if self.preset is not None:
            f0, metallic = F0_PRESETS[self.preset]
            color = f0 if metallic else color
        return {
            "color": color,
            "metallic": metallic,
            "roughness": self.roughness,
            "f0": f0,
            "smith": float(get_args(Smith).index(self.smith)),
            "coupling": float(get_args(Coupling).index(self.coupled_by)),
            "multiple": float("MULTIPLE_SCATTERING" in self.features()),
        } | self._layers()

    @property
    def coupled_by(self) -> Coupling:
        """Return `coupling`, or its default if it is None."""
        return self.coupling or ("albedo" if self.smith == "height_correlated" else "fresnel")

    def _layers(self) -> dict[str, Parameter]:
        """Return the parameters of the extensions in use."""
        has, values = self.features(), dict[str, Parameter]()
        if "SPECULAR" in has:
            values |= {"specular": self.specular, "specular_color": self.specular_color}
        if "CLEARCOAT" in has:
            values |= {"clearcoat": self.clearcoat, "clearcoat_roughness": self.clearcoat_roughness}
            values |= {} if self.clearcoat_normal_map is None else {"clearcoat_normal_map": self.clearcoat_normal_map}
        if "SHEEN" in has:
            values |= {"sheen_color": self.sheen_color, "sheen_roughness": self.sheen_roughness}
        if "LAYER_ENERGY" in has:
            rows = [layer_energy.rows(roughness) for roughness in self._roughnesses(has)]
            values |= {
                "layer_energy": layer_energy.tables(*rows, self.smith),
                "last_rows": tuple(len(each) - 1.0 for each in rows),
            }
        if "ANISOTROPY" in has:
            values |= self._anisotropic("ANISOTROPY_ALBEDO" in has)
        if "DIFFUSE_THROUGH" in has:
            values |= {
                "diffuse_transmission": self.diffuse_transmission,
                "diffuse_transmission_color": self.diffuse_transmission_color,
            }
        if "IRIDESCENCE" in has:
            values |= {name: getattr(self, name) for name in FILM}
        return values | ({"transmission": self.transmission} if "THROUGH" in has else {})

    def _anisotropic(self, with_albedo: bool) -> dict[str, Parameter]:
        """Return the parameters of anisotropy."""
        values: dict[str, Parameter] = {
            "anisotropy": self.anisotropy,
            "anisotropy_cos": cos(radians(self.anisotropy_degrees)),
            "anisotropy_sin": sin(radians(self.anisotropy_degrees)),
        }
        if self.anisotropy_map is not None:
            values["anisotropy_map"] = self.anisotropy_map
        if with_albedo:
            textured = isinstance(self.anisotropy, Texture) or isinstance(self.roughness, Texture)
            values["anisotropy_energy"] = anisotropy_energy.tables(
                *((None, None) if textured else (self.roughness, self.anisotropy))
            )
            values["anisotropy_last_row"] = anisotropy_energy.ROWS - 1.0 if textured else 0.0
        return values

    def _roughnesses(self, has: frozenset[str]) -> tuple[Unit | Texture, ...]:
        """Return the roughnesses of base, film and fibres; for an absent layer, any number."""
        return (
            self.roughness,
            self.clearcoat_roughness if "CLEARCOAT" in has else 0.0,
            self.sheen_roughness if "SHEEN" in has else 1.0,
        )

    @property
    def bent_by(self) -> Texture | None:
        along = (self.anisotropy_map, self.anisotropy, ALONG_U) if self.anisotropy != 0 else ()
        return self._normal_map or next((texture for texture in along if isinstance(texture, Texture)), None)

    @property
    def _normal_map(self) -> Texture | None:
        return self.normal_map or (self.clearcoat_normal_map if self.clearcoat != 0 else None)

    def conflicts(self) -> list[str]:
        fault = 'anisotropy: is for smith = "height_correlated"; leave smith out, or write anisotropy = 0'
        faults = super().conflicts()
        faults += [fault] if self.anisotropy != 0 and self.smith != "height_correlated" else []
        coupled = [name for name in ("iridescence", "diffuse_transmission") if getattr(self, name) != 0]
        if self.coupled_by != "albedo":
            faults += [f'{name}: is for coupling = "albedo"; write that, or {name} = 0' for name in coupled]
        return faults

    @property
    def lobes(self) -> Lobes:
        """Return its constant parameters as lobes; TypeError if one of them is a texture."""
        single = self.parameters()
        color, f0, metallic, roughness = (single[name] for name in ("color", "f0", "metallic", "roughness"))
        if not (
            isinstance(color, tuple)
            and isinstance(f0, tuple)
            and isinstance(metallic, float | int)
            and isinstance(roughness, float | int)
        ):
            raise TypeError("a texture has no lobes of its own")
        f0 = tuple(f + metallic * (c - f) for f, c in zip(f0, color))
        return Lobes(f0, tuple((1 - metallic) * c for c in color), max(roughness**2, ALPHA_MIN))

    def features(self) -> frozenset[str]:
        metallic = self.metallic if self.preset is None else F0_PRESETS[self.preset][1]
        layers = {
            "CLEARCOAT": self.clearcoat != 0,
            "SHEEN": self.sheen_color != (0, 0, 0),
            "THROUGH": self.transmission != 0,
            "DIFFUSE_THROUGH": self.diffuse_transmission != 0 and metallic != 1,
        }
        further = self.coupled_by == "albedo" if self.multiple_scattering is None else self.multiple_scattering
        # With the albedo coupling the diffuse lobe reflects what the specular one does not, so only metal loses energy.
        further &= metallic != 0 or self.coupled_by != "albedo" or layers["THROUGH"]
        above = layers["CLEARCOAT"] or layers["SHEEN"]
        coupled = metallic != 1 or above  # the coupled lobe also carries what layers take from the gloss
        fitted = further or (coupled and self.coupled_by == "albedo")
        # A clearcoat's own albedo is that of the height-correlated form.
        forms = {self.smith} if fitted else set()
        forms |= {"height_correlated"} if layers["CLEARCOAT"] else set()
        has = {
            f"SMITH_{self.smith.upper()}": True,
            f"COUPLING_{self.coupled_by.upper()}": coupled,
            "MULTIPLE_SCATTERING": further,
            "GGX_ALBEDO": bool(forms),
            **layers,
            **{f"ALBEDO_{form.upper()}": True for form in forms},
            "COAT_NORMALS": layers["CLEARCOAT"] and self._normal_map is not None,
            "LAYERS": any(layers.values()),
            "LAYER_ENERGY": above,
            "LAYER_ROWS": above
            and any(isinstance(r, Texture) for r in (self.roughness, self.clearcoat_roughness, self.sheen_roughness)),
            "IRIDESCENCE": self.iridescence != 0,
            "ANISOTROPY": self.anisotropy != 0,
            "ANISOTROPY_ALBEDO": self.anisotropy != 0 and bool(forms),
            "ANISOTROPY_MAP": self.anisotropy != 0 and self.anisotropy_map is not None,
            "SPECULAR": self.specular != 1 or self.specular_color != (1, 1, 1),
            "TRANSMISSION": layers["THROUGH"] or layers["DIFFUSE_THROUGH"],
            "TRANSMISSION_LOBES": layers["THROUGH"] or layers["DIFFUSE_THROUGH"],
        }
        return frozenset(name for name, present in has.items() if present)
