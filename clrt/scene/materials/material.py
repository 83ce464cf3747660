"""Fields and methods that all materials share (scene.materials)."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from enum import Enum
from functools import lru_cache
from types import NoneType
from typing import Annotated, Any, ClassVar, Self, get_args, get_origin, get_type_hints

from ..fields.group_name import GroupName
from ..fields.limits import Ge, Le
from ..fields.validated import Validated
from ..render_settings import Culling
from .textures import NonNegative, Texture

Unit = Annotated[float, Ge(0), Le(1)]
Albedo = tuple[Unit, Unit, Unit]
Radiance = tuple[NonNegative, NonNegative, NonNegative]
Parameter = float | tuple[float, ...] | Texture

#: Below this alpha GGX exceeds float32 (D ~ 1/(pi alpha²)), also in the kernel; use `Mirror` for perfect reflection.
ALPHA_MIN = 1e-4
#: Largest index of refraction.
MOST_IOR = 4.0


@dataclass(frozen=True, kw_only=True)
class Material(Validated):
    """Base class of materials, with the fields that all have.

    - emission: radiance in W·sr⁻¹·m⁻² that its front side emits
    - double_sided: its back side emits, too, and is not subject to back-face culling (glTF's doubleSided)
    - one_sided: invisible from behind
    - normal_map: perturbs the shading normal (glTF's convention: linear, x to the right and y up in the image); its
      factor scales x and y
    - opacity: the fraction of light that interacts with the surface; the rest passes straight through
    - camera_visible: false for a surface that camera rays pass through, also where it emits; all others hit it
    - catcher: the image does not show the surface, but what the scene's other surfaces change about its light
    - light_group: the name of the layer that what it emits is stored in (docs/light-groups.md), "" for the rest
    - alpha_cutoff (alpha mask): the surface is opaque where the opacity reaches it, and absent elsewhere
    """

    kernel: ClassVar[str]
    #: Features with a kernel file of their own, bsdf/<name>.cl: `#include <NAME>_FILE`.
    parts: ClassVar[tuple[str, ...]] = ()
    emission: Radiance | Texture = (0.0, 0.0, 0.0)
    normal_map: Texture | None = None
    opacity: Unit | Texture = 1.0
    alpha_cutoff: Unit | None = None
    one_sided: bool = False
    double_sided: bool = False
    camera_visible: bool = True
    catcher: bool = False
    light_group: GroupName = ""

    def parameters(self) -> dict[str, Parameter]:
        """Return the values its kernel reads: numbers, triples, rows of a multiple of four, or textures in their place.

        A parameter that only others of its type return is the field of that name, or 0 if there is no such field.
        """
        return {field.name: getattr(self, field.name) for field in fields(self) if field.name not in SHARED}

    def surface_parameters(self, culling: Culling) -> dict[str, Parameter]:
        """Return the values of the fields above that surface kernels read, unless they are the defaults.

        The kernels' one_sided is 1 if no ray hits the back face, 0.5 if no camera ray does, and 2 more if camera rays
        hit neither side.
        """
        parameters: dict[str, Parameter] = {}
        if self.normal_map is not None:
            parameters["normal_map"] = self.normal_map
        one_sided = 1.0 if self.one_sided or culling == "all" and self.is_culled else 0.0
        if culling == "camera" and self.is_culled:
            one_sided = max(one_sided, 0.5)
        one_sided += 0.0 if self.camera_visible else 2.0
        if self.opacity != 1 or one_sided:
            cutoff = -1.0 if self.alpha_cutoff is None else self.alpha_cutoff
            # Not a field's name: materials without it get 0, and are opaque whatever the alpha of vertex colors.
            parameters["cutoff"] = 0.0 if self.opacity == 1 else cutoff
            parameters |= {"opacity": self.opacity, "one_sided": one_sided}
        if self.catcher:
            parameters["catcher"] = 1.0
        return parameters

    @property
    def is_culled(self) -> bool:
        """Whether back-face culling applies; not to transmissive materials, whose back faces light inside must hit."""
        return not (self.double_sided or "TRANSMISSION" in self.features())

    @property
    def radiance(self) -> Radiance:
        """Return the emitted radiance, the maximum (factor) if it is textured."""
        return as_color(self.emission.factor) if isinstance(self.emission, Texture) else self.emission

    def conflicts(self) -> list[str]:
        if self.catcher and any(self.radiance):
            return ["catcher: a catcher shows light that it receives, and this one emits; leave out one of them"]
        if self.catcher and not self.camera_visible:
            return ["catcher: a catcher must be seen by the camera; leave out camera_visible = false"]
        return []

    def without_textures(self: Self) -> Self:
        """Return the material with each texture replaced by its factor."""
        plain: dict[str, Any] = {
            name: None if role is TextureRole.MAP else factor_of(getattr(self, name), role)
            for name, role in texture_roles(type(self)).items()
            if isinstance(getattr(self, name), Texture)
        }
        return replace(self, **plain)

    @property
    def bent_by(self) -> Texture | None:
        """The texture, such as a normal map, whose coordinates its tangents follow, if it needs them."""
        return self.normal_map

    def textures(self) -> list[Texture]:
        """Return all its textures."""
        values = (getattr(self, field.name) for field in fields(self))
        return [value for value in values if isinstance(value, Texture)]

    @property
    def is_specular(self) -> bool:
        """Whether it scatters into discrete directions only, which light sampling cannot find."""
        return False

    def in_unit(self, unit: float) -> Material:
        """Return the material for a scene whose lengths are all multiplied by `unit`."""
        return self

    def features(self) -> frozenset[str]:
        """Return the macros to define, for parts of the kernel that only some materials of this type need."""
        return frozenset()


#: Fields that the material's own kernel file does not read.
SHARED = frozenset(field.name for field in fields(Material))


class TextureRole(Enum):
    """What a texture in a field stands for: a color, a number, or a map, which has no plain value."""

    COLOR = "color"
    NUMBER = "number"
    MAP = "map"


def texture_roles(kind: type) -> dict[str, TextureRole]:
    """Return the roles of the fields of a material type that accept textures, by the fields' types: `Albedo | Texture`,
    `Unit | Texture` or `Texture | None`."""
    return _texture_roles(kind)


@lru_cache
def _texture_roles(kind: type) -> dict[str, TextureRole]:
    roles: dict[str, TextureRole] = {}
    for name, hint in get_type_hints(kind).items():
        accepted = get_args(hint)
        if Texture in accepted:
            is_color = any(get_origin(part) is tuple for part in accepted)
            roles[name] = (
                TextureRole.MAP
                if {*accepted} == {Texture, NoneType}
                else TextureRole.COLOR
                if is_color
                else TextureRole.NUMBER
            )
    return roles


def factor_of(texture: Texture, role: TextureRole) -> float | Radiance:
    """Return the texture's factor, three numbers for a color."""
    return as_color(texture.factor) if role is TextureRole.COLOR else texture.factor


def as_color(factor: float | Radiance) -> Radiance:
    """Return a color from three numbers, or from one for all channels."""
    return factor if isinstance(factor, tuple) else (factor, factor, factor)
